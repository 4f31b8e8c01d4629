"""Path -> Twist2: regulated pure pursuit that trusts the fresh scan more than the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2, Twist2, wrap_angle
from occmap.grid import OccupancyGrid
from occmap.path import Path
from occmap.scan import Scan


@dataclass(frozen=True)
class FollowerConfig:
    """How a differential drive follows a path."""

    body_radius_m: float = 0.17
    """A circle around the robot's axis that encloses the body."""
    max_speed_mps: float = 0.5
    """What the base does at most."""
    max_turn_radps: float = 1.5
    """What the base turns at most."""
    acceleration_mps2: float = 1.0
    """The base's ramp: how fast it gains and loses speed."""
    turn_acceleration_radps2: float = 3.0
    """The base's ramp for turning."""
    slow_speed_mps: float = 0.12
    """Through gaps, and backing out."""
    braking_mps2: float = 0.5
    """Half of what the base can do: foreseen stops and bends leave the rest for the unforeseen."""
    safe_margin_m: float = 0.02
    """Air that is left to every point of the scan: three sigma of a range averaged over neighbouring beams."""
    near_margin_m: float = 0.03
    """Past things this close the robot drives at slow speed,"""
    roomy_margin_m: float = 0.18
    """and from here on as fast as it can."""
    tight_margin_m: float = 0.10
    """Less room than this on the way is a gap to be lined up with before it is driven into."""
    retreat_m: float = 0.25
    """So far the robot backs out of a place where it cannot get on, to try again from there."""
    patience_s: float = 1.5
    """So long it looks again first: the next scan may see better."""
    nearest_aim_m: float = 0.25
    """Shortest look-ahead."""
    farthest_aim_m: float = 0.60
    """Longest look-ahead, at full speed."""
    turn_from_rad: float = 1.0
    """The robot turns in place if it looks away from its aim by more,"""
    turn_until_rad: float = 0.3
    """until it does by less."""
    arrive_within_m: float = 0.08
    """This near to its end a path has been driven."""
    period_s: float = 0.1
    """A command stands for so long."""

    def __post_init__(self) -> None:
        for name in ("body_radius_m", "max_speed_mps", "max_turn_radps", "slow_speed_mps", "period_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if not 0.0 < self.nearest_aim_m <= self.farthest_aim_m:
            raise ValueError(
                f"need 0 < nearest_aim_m <= farthest_aim_m, got {self.nearest_aim_m}, {self.farthest_aim_m}"
            )


@dataclass(frozen=True, slots=True)
class Steering:
    """What the follower does now."""

    twist: Twist2
    progress_m: float
    """How far along the path the robot is."""
    off_path_m: float
    """How far beside it."""
    arrived: bool
    """At the path's end."""
    held_up_s: float
    """For how long something in the scan has barred the way; 0 while the robot gets on."""


SPACING_M = 0.05
AHEAD = 28  # samples of the way: 1.4 m


class Follower:
    """Regulated pure pursuit (Macenski et al. 2023) on a way centred between what the scan sees.

    Remembers the path it is on, how far it got, whether it is turning in place, and for how long it
    has been held up.
    """

    def __init__(self, config: FollowerConfig | None = None) -> None:
        from occmap import follower_kernels

        self.config = config or FollowerConfig()
        self._kernels = follower_kernels
        self._path: Path | None = None
        self._progress_m = 0.0
        self._is_turning = False
        self._farthest_m = 0.0
        self._held_up_s = 0.0
        self._waited_s = 0.0
        self._retreat_m = 0.0
        self._way = np.empty((AHEAD, 2))
        self._left, self._right, self._around = np.empty(AHEAD), np.empty(AHEAD), np.empty(AHEAD)
        self._hits = np.empty((0, 2))
        self._lone = np.empty((0, 2))

    def follow(
        self,
        path: Path,
        map_from_robot: Pose2,
        twist: Twist2,
        scan: Scan,
        robot_from_lidar: Pose2,
        grid: OccupancyGrid,
        clearance_m: NDArray[np.float32],
    ) -> Steering:
        """The next twist along a path, given the twist of the moment and the scan just taken."""
        off_m = self._place(path, map_from_robot)
        n_hits = self._look(scan, robot_from_lidar, map_from_robot, grid, clearance_m)
        remaining_m = path.length_m - self._progress_m
        goal_x, goal_y = path.goal
        goal_m = math.hypot(goal_x - map_from_robot.x_m, goal_y - map_from_robot.y_m)
        if remaining_m < self.config.arrive_within_m and goal_m < 2.0 * self.config.arrive_within_m:
            self._held_up_s = 0.0
            return Steering(Twist2.zero(), self._progress_m, off_m, True, 0.0)
        aim, limit_mps = self._aim(path, map_from_robot, twist, n_hits)
        limit_mps = min(limit_mps, math.sqrt(2.0 * self.config.braking_mps2 * max(remaining_m, 0.01)))
        command = self._steer(aim, limit_mps, twist, self._progress_m < path.escape_m, n_hits)
        return Steering(command, self._progress_m, off_m, False, self._held_up_s)

    def _place(self, path: Path, map_from_robot: Pose2) -> float:
        """Find the robot on the path, not far from where it was; metres beside it."""
        if path is not self._path:
            self._path, self._is_turning = path, False
            self._progress_m = self._farthest_m = self._held_up_s = self._waited_s = self._retreat_m = 0.0
        at_m, off_m = self._kernels.place_on_path(
            path.waypoints_in_map, path.stations_m, map_from_robot.x_m, map_from_robot.y_m,
            self._progress_m - 0.3, self._progress_m + 1.0,
        )  # fmt: skip
        self._progress_m = at_m
        if at_m > self._farthest_m + 0.02:
            self._farthest_m, self._held_up_s, self._waited_s = at_m, 0.0, 0.0
        return off_m

    def _look(
        self,
        scan: Scan,
        robot_from_lidar: Pose2,
        map_from_robot: Pose2,
        grid: OccupancyGrid,
        clearance_m: NDArray,
    ) -> int:
        """Gather what the scan sees nearby into `_hits`; how many."""
        n = len(scan.ranges_m)
        if len(self._hits) < n:
            self._hits, self._lone = np.empty((n, 2)), np.empty((n, 2))
        n_hits, n_lone = self._kernels.near_hits(
            scan.ranges_m, scan.bearings_rad, scan.min_range_m, scan.max_range_m, 1.5, 0.1, 3,
            robot_from_lidar.x_m, robot_from_lidar.y_m, robot_from_lidar.yaw_rad, self._hits, self._lone,
        )  # fmt: skip
        return self._kernels.keep_believed(
            self._lone, n_lone, self._hits, n_hits, map_from_robot.x_m, map_from_robot.y_m, map_from_robot.yaw_rad,
            clearance_m, *grid.frame.origin_m, grid.frame.resolution_m, 1.5 * grid.frame.resolution_m,
        )  # fmt: skip

    def _aim(
        self, path: Path, map_from_robot: Pose2, twist: Twist2, n_hits: int
    ) -> tuple[tuple[float, float], float]:
        """The point to steer for, in the robot's frame, and the speed that the way there allows."""
        c, k, way = self.config, self._kernels, self._way
        n_way = k.sample_path(
            path.waypoints_in_map, path.stations_m, self._progress_m, SPACING_M,
            map_from_robot.x_m, map_from_robot.y_m, map_from_robot.yaw_rad, way,
        )  # fmt: skip
        roomy_m = c.body_radius_m + c.roomy_margin_m
        k.centre(way, n_way, self._hits, n_hits, roomy_m, 0.15, self._left, self._right, self._around)
        k.rooms(way, n_way, self._hits, n_hits, 0.2, roomy_m, self._left, self._right, self._around)
        limit_mps = k.speed_limit(
            way, n_way, self._around, SPACING_M, c.max_speed_mps, c.slow_speed_mps,
            c.body_radius_m + c.near_margin_m, roomy_m, 0.8 * c.max_turn_radps, c.braking_mps2,
        )  # fmt: skip
        aligned = k.alignment(way, n_way, self._around, c.body_radius_m + c.tight_margin_m, 14)
        limit_mps = min(limit_mps, c.slow_speed_mps + (c.max_speed_mps - c.slow_speed_mps) * aligned)
        farthest_m = min(max(1.2 * abs(twist.linear_mps), c.nearest_aim_m), c.farthest_aim_m)
        need_m = min(c.body_radius_m + 0.06, float(self._around[: min(n_way, 12)].min()) - 0.01)
        j = k.farthest_aim(way, n_way, self._hits, n_hits, SPACING_M, c.nearest_aim_m, farthest_m, need_m)
        return (float(way[j, 0]), float(way[j, 1])), limit_mps

    def _steer(
        self, aim: tuple[float, float], limit_mps: float, twist: Twist2, may_reverse: bool, n_hits: int
    ) -> Twist2:
        """Drive the arc through the aim if it is free, slower if that helps; else find a way around what bars it."""
        c = self.config
        x, y = aim
        bearing = math.atan2(y, x)
        if self._retreat_m > 0.0:
            return self._retreat(twist, bearing, n_hits)
        direction = -1.0 if may_reverse and abs(bearing) > 2.0 else 1.0
        error = bearing if direction > 0.0 else wrap_angle(bearing - math.pi)
        self._is_turning = abs(error) > (c.turn_until_rad if self._is_turning else c.turn_from_rad)
        if self._is_turning:
            return self._turn(error)
        curvature = 2.0 * y / max(x * x + y * y, 1e-6)
        top = min(limit_mps, 0.8 * c.max_turn_radps / max(abs(curvature), 1e-6))
        if direction < 0.0:
            top = min(top, c.slow_speed_mps)
        for share in (1.0, 0.6, 0.3):
            v = direction * top * share
            w = min(max(v * curvature, -c.max_turn_radps), c.max_turn_radps)
            if self._is_free(twist, v, w, n_hits):
                return Twist2(v, w)
        return self._evade(twist, bearing, n_hits)

    def _evade(self, twist: Twist2, bearing: float, n_hits: int) -> Twist2:
        """The arc to the aim is barred: go slowly in the free direction nearest to it, or back out."""
        c = self.config
        self._held_up_s += c.period_s
        self._waited_s += c.period_s
        safe_m = c.body_radius_m + c.safe_margin_m
        free = self._kernels.free_bearing(bearing, 1.5, 0.1, self._hits, n_hits, safe_m)
        if math.isnan(free):
            if self._waited_s >= c.patience_s:
                self._retreat_m, self._waited_s = c.retreat_m, 0.0
            return Twist2.zero()
        error = wrap_angle(free)
        if abs(error) > 0.1:
            return self._turn(error)
        is_free = self._is_free(twist, c.slow_speed_mps, 0.0, n_hits)
        return Twist2(c.slow_speed_mps if is_free else 0.0, 0.0)

    def _retreat(self, twist: Twist2, bearing: float, n_hits: int) -> Twist2:
        """Back out the way the robot came, as far as that is free; then try again."""
        c = self.config
        self._held_up_s += c.period_s
        self._retreat_m -= c.slow_speed_mps * c.period_s
        if self._is_free(twist, -c.slow_speed_mps, 0.0, n_hits):
            return Twist2(-c.slow_speed_mps, 0.0)
        self._retreat_m = 0.0
        return self._turn(bearing)

    def _turn(self, error: float) -> Twist2:
        """Turn in place by an angle, as fast as it can be ended in time."""
        c = self.config
        rate = min(
            c.max_turn_radps, math.sqrt(1.2 * c.turn_acceleration_radps2 * abs(error)), 3.0 * abs(error)
        )
        return Twist2(0.0, math.copysign(rate, error))

    def _is_free(self, twist: Twist2, v: float, w: float, n_hits: int) -> bool:
        c = self.config
        hold_s = min(max(0.1 / max(abs(v), 1e-3), 3.0 * c.period_s), 1.0)
        return self._kernels.is_free(
            twist.linear_mps, twist.angular_radps, v, w, hold_s, c.acceleration_mps2,
            c.turn_acceleration_radps2, self._hits, n_hits, c.body_radius_m + c.safe_margin_m,
        )  # fmt: skip
