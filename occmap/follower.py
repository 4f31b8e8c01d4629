"""Path -> Twist2: regulated pure pursuit that trusts the fresh scan more than the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.body import Body
from occmap.config_checks import NeverNegative
from occmap.geometry import Pose2, Twist2, wrap_angle
from occmap.grid import OccupancyGrid
from occmap.path import Path
from occmap.scan import Scan
from occmap.surroundings import Base, Surroundings
from occmap.way import Drive, Way

BRAKING_SHARE, BEND_SHARE = 0.5, 0.8
"""Of what the base can do, no more is planned with."""
LOOK_BACK_M, LOOK_ON_M = 0.3, 1.0
"""On a path the robot is looked for so far before and beyond where it was: paths may cross themselves."""
GOT_ON_M = 0.02
"""A robot that comes by less farther than ever has not got on: noise."""
SPEED_SHARES = (1.0, 0.6, 0.3)
"""Of the speed that the way allows, what is tried in turn where something bars the arc to the aim."""
NEVER_LEFT_M = 0.01
"""At the end of a path so much is taken to be left: braking for nothing, the robot would never arrive."""
EVADE_M, EVADE_RAD = 0.1, 0.1
"""A direction to evade to is free for this far; the robot turns until it is less off it."""
TURN_BRAKING_SHARE = 0.6
"""Of what the base can do, what a turn in place is braked with,"""
TURN_GAIN_PER_S = 3.0
"""and so much of what is left of it is turned per second: it ends softly."""
FREE_M, CREEP_MPS = 0.1, 0.1
"""A command must be free for so far, a slower one as if it were this fast,"""
FREE_PERIODS, FREE_AT_MOST_S = 3.0, 1.0
"""and for so many periods; but no longer than this."""
LEAST_CURVATURE, LEAST_SQUARE_M2 = 1e-6, 1e-6
"""Keep divisions off zero."""


@dataclass(frozen=True)
class FollowerConfig(NeverNegative):
    """How a differential drive follows a path."""

    slow_speed_mps: float = 0.12
    """Through gaps, and backing out."""
    braking_mps2: float = 0.5
    """At foreseen stops and bends, and never more than half of what the base can do: the rest is for the
    unforeseen."""
    safe_margin_m: float = 0.02
    """Air left to every point of the scan: over two sigma of a range averaged over its neighbours."""
    near_margin_m: float = 0.03
    """Past things this close the robot drives at slow speed,"""
    roomy_margin_m: float = 0.18
    """and from here on as fast as it can."""
    tight_margin_m: float = 0.10
    """Less room than this on the way is a gap to be lined up with before it is driven into."""
    evade_within_rad: float = 0.9
    """What bars the way is passed in a direction at most so far off the aim; less than turn_from_rad."""
    retreat_m: float = 0.25
    """So far the robot backs out of a place where it cannot get on, to try again from there."""
    patience_s: float = 1.5
    """So long it looks again first: the next scan may see better."""
    nearest_aim_m: float = 0.25
    """Shortest look-ahead."""
    farthest_aim_m: float = 0.60
    """Longest look-ahead."""
    aim_time_s: float = 1.2
    """Between the two, the robot looks so long ahead."""
    aim_margin_m: float = 0.06
    """Air beside the straight line to the aim: looking across a corner would cut it."""
    bend_turn_radps: float = 1.2
    """Bends are driven so slowly that this turn rate does, or four fifths of what the base can do: the rest
    is for corrections."""
    back_out_from_rad: float = 2.0
    """Out of a place too near to a wall the robot drives backwards if its aim is farther off its nose."""
    turn_from_rad: float = 1.0
    """The robot turns in place if it looks away from its aim by more,"""
    turn_until_rad: float = 0.3
    """until it does by less."""
    arrive_within_m: float = 0.08
    """This near to its end a path has been driven."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("slow_speed_mps", "braking_mps2", "bend_turn_radps", "arrive_within_m"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} must be positive, got 0.0")
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
    """For how long it has got no farther since something in the scan barred the way; 0 while it gets on."""


@dataclass
class Progress:
    """What the follower remembers of the path it is on."""

    path: Path | None = None
    progress_m: float = 0.0
    farthest_m: float = 0.0
    """How far it ever got."""
    is_turning: bool = False
    """In place, until it looks where it is going."""
    held_up_s: float = 0.0
    waited_s: float = 0.0
    """For how long nothing ahead was free."""
    retreat_m: float = 0.0
    """Still to be backed out."""


class Follower:
    """Regulated pure pursuit (Macenski et al. 2023) of a way centred between what the scan sees.

    The arc to the aim is driven only if the scan shows that the robot can stop on it in time. If it
    cannot at any speed, it goes the free direction nearest to the aim; if there is none, it waits,
    then backs out and tries again. Who gives up is whoever chose the path: see Steering.held_up_s.
    """

    def __init__(self, config: FollowerConfig | None = None, body: Body | None = None) -> None:
        self.config = c = config or FollowerConfig()
        self.body = b = body or Body()
        self._bend_turn_radps = min(c.bend_turn_radps, BEND_SHARE * b.max_turn_radps)
        self._braking_mps2 = min(c.braking_mps2, BRAKING_SHARE * b.acceleration_mps2)
        base = Base(b.radius_m + c.safe_margin_m, b.acceleration_mps2, b.turn_acceleration_radps2)
        self.surroundings = Surroundings(base)
        drive = Drive(
            top_mps=min(b.max_speed_mps, self.surroundings.can_stop_from_mps),
            slow_mps=c.slow_speed_mps,
            turn_radps=self._bend_turn_radps,
            braking_mps2=self._braking_mps2,
            near_m=b.radius_m + c.near_margin_m,
            roomy_m=b.radius_m + c.roomy_margin_m,
            tight_m=b.radius_m + c.tight_margin_m,
        )
        self.way = Way(drive)
        self._now = Progress()

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
        now = self._now
        if self._has_arrived(path, map_from_robot):
            return Steering(Twist2.zero(), now.progress_m, off_m, True, 0.0)
        self.surroundings.look(scan, robot_from_lidar, map_from_robot, grid, clearance_m)
        self.way.look_along(path, now.progress_m, map_from_robot, self.surroundings.hits)
        command = self._steer(path, twist)
        return Steering(command, now.progress_m, off_m, False, now.held_up_s)

    def _place(self, path: Path, map_from_robot: Pose2) -> float:
        """Find the robot on the path, not far from where it was; metres beside it."""
        if path is not self._now.path:
            self._now = Progress(path)
        now = self._now
        now.progress_m, off_m = self.way.place(
            path, map_from_robot, now.progress_m - LOOK_BACK_M, now.progress_m + LOOK_ON_M
        )
        if now.progress_m > now.farthest_m + GOT_ON_M:
            now.farthest_m, now.held_up_s, now.waited_s = now.progress_m, 0.0, 0.0
        if now.held_up_s > 0.0:
            now.held_up_s += self.body.period_s
        return off_m

    def _has_arrived(self, path: Path, map_from_robot: Pose2) -> bool:
        """Whether the robot is at the end, both along the path and as the crow flies."""
        x, y = path.goal
        away_m = math.hypot(x - map_from_robot.x_m, y - map_from_robot.y_m)
        near_m = self.config.arrive_within_m
        return path.length_m - self._now.progress_m < near_m and away_m < 2.0 * near_m

    def _steer(self, path: Path, twist: Twist2) -> Twist2:
        """Drive the arc through the aim if it is free, slower if that helps; else get past what bars it."""
        c, now = self.config, self._now
        farthest_m = min(max(c.aim_time_s * abs(twist.linear_mps), c.nearest_aim_m), c.farthest_aim_m)
        room_m = self.body.radius_m + c.aim_margin_m
        x, y = self.way.aim(self.surroundings.hits, c.nearest_aim_m, farthest_m, room_m)
        bearing = math.atan2(y, x)
        if now.retreat_m > 0.0:
            return self._retreat(twist, bearing)
        is_backward = now.progress_m < path.escape_m and abs(bearing) > c.back_out_from_rad
        error = wrap_angle(bearing - math.pi) if is_backward else bearing
        now.is_turning = abs(error) > (c.turn_until_rad if now.is_turning else c.turn_from_rad)
        if now.is_turning:
            return self._turn(error)
        curvature = 2.0 * y / max(x * x + y * y, LEAST_SQUARE_M2)
        speed = self._speed_limit_mps(path, curvature, is_backward)
        for share in SPEED_SHARES:
            v = share * (-speed if is_backward else speed)
            command = Twist2(v, v * curvature)
            if self._is_free(twist, command):
                return command
        return self._evade(twist, bearing)

    def _speed_limit_mps(self, path: Path, curvature: float, is_backward: bool) -> float:
        """Highest speed that the way, the arc to the aim and the path's end allow."""
        c = self.config
        remaining_m = max(path.length_m - self._now.progress_m, NEVER_LEFT_M)
        return min(
            self.way.speed_limit_mps(),
            self._bend_turn_radps / max(abs(curvature), LEAST_CURVATURE),
            math.sqrt(2.0 * self._braking_mps2 * remaining_m),
            c.slow_speed_mps if is_backward else self.body.max_speed_mps,
        )

    def _evade(self, twist: Twist2, bearing: float) -> Twist2:
        """Go slowly in the free direction nearest to the aim; if there is none for a while, back out."""
        c, now = self.config, self._now
        now.held_up_s = max(now.held_up_s, self.body.period_s)
        now.waited_s += self.body.period_s
        free = self.surroundings.free_bearing(bearing, c.evade_within_rad, EVADE_M)
        if free is None:
            if now.waited_s >= c.patience_s:
                now.retreat_m, now.waited_s = c.retreat_m, 0.0
            return Twist2.zero()
        error = wrap_angle(free)
        if abs(error) > EVADE_RAD:
            return self._turn(error)
        onward = Twist2(c.slow_speed_mps, 0.0)
        return onward if self._is_free(twist, onward) else Twist2.zero()

    def _retreat(self, twist: Twist2, bearing: float) -> Twist2:
        """Back out the way the robot came, as far as that is free; then try again."""
        c = self.config
        self._now.retreat_m -= c.slow_speed_mps * self.body.period_s
        back = Twist2(-c.slow_speed_mps, 0.0)
        if self._is_free(twist, back):
            return back
        self._now.retreat_m = 0.0
        return self._turn(bearing)

    def _turn(self, error: float) -> Twist2:
        """Turn in place by an angle, as fast as it can be ended in time. A round body may turn anywhere."""
        in_time = math.sqrt(2.0 * TURN_BRAKING_SHARE * self.body.turn_acceleration_radps2 * abs(error))
        rate = min(self.body.max_turn_radps, in_time, TURN_GAIN_PER_S * abs(error))
        return Twist2(0.0, math.copysign(rate, error))

    def _is_free(self, twist: Twist2, command: Twist2) -> bool:
        """Whether a command is safe for some periods, or slowly for some way, and while braking after it."""
        way_s = FREE_M / max(abs(command.linear_mps), CREEP_MPS)
        hold_s = min(max(way_s, FREE_PERIODS * self.body.period_s), FREE_AT_MOST_S)
        return self.surroundings.is_free(twist, command, hold_s)
