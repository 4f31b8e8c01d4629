"""Told from what the robot senses alone: the wheels turn, the robot does not."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from occmap.config_checks import Positive
from occmap.geometry import Pose2, Twist2, wrap_angle
from occmap.scan import Observation, Scan

FEWEST_BEAMS = 8
"""Fewer are no view: what they meet next may well be as far away."""
LEAST_SHARE = 0.2
"""Of all beams, that must return twice to be a view: a featureless place says nothing about motion."""
SAME_RANGE_SHARE = 0.015
"""Of itself, by which a range may change beyond same_range_m and be the same."""
JUMP_M, JUMP_RAD = 0.2, 0.4
"""Odometry that moves by more than this beyond twice what was commanded was set anew."""
ROUNDING_S = 1e-6
"""Times of scans are sums of periods."""


@dataclass(frozen=True)
class StuckConfig(Positive):
    """When to believe that the robot does not move."""

    window_s: float = 2.0
    """Motion is judged over this long: commands take effect within a fraction of it."""
    min_commanded_m: float = 0.3
    """Less driving than this commanded over the window,"""
    min_commanded_rad: float = 0.8
    """and less turning than this: no verdict."""
    still_m: float = 0.03
    """Odometry that stays within this much of a place all the while,"""
    still_rad: float = 0.05
    """and within this much of a heading: the wheels are held."""
    slipped_m: float = 0.3
    """Odometry that says it got this far,"""
    slipped_rad: float = 0.5
    """or turned by this much, is held against the lidar's view."""
    same_range_m: float = 0.06
    """A range that changed by less, plus 1.5 % of itself, is the same: over two sigma of the difference
    of two ranges, 2 cm and 0.5 % each."""
    same_share: float = 0.9
    """Share of beams unchanged from which on two scans are the same view."""


@dataclass(frozen=True, slots=True)
class _Moment:
    time_s: float
    odom_from_robot: Pose2
    scan: Scan
    twist: Twist2  # commanded from this moment on


class StuckDetector:
    """Compares what was commanded over a short window with what odometry and lidar say happened."""

    def __init__(self, config: StuckConfig | None = None) -> None:
        self.config = config or StuckConfig()
        self._moments: deque[_Moment] = deque()

    def reset(self) -> None:
        """Forget what was commanded: the window begins anew."""
        self._moments.clear()

    @property
    def last_twist(self) -> Twist2:
        """The latest command."""
        return self._moments[-1].twist if self._moments else Twist2.zero()

    def remember(self, seen: Observation, twist: Twist2) -> None:
        """Note the twist that is about to be commanded."""
        self._moments.append(_Moment(seen.time_s, seen.odom_from_robot, seen.scan, twist))
        while seen.time_s - self._moments[0].time_s > self.config.window_s + ROUNDING_S:
            self._moments.popleft()

    def is_stuck(self, seen: Observation) -> bool:
        """True if the last window's commands should have moved the robot and did not."""
        if not self._moments or seen.time_s - self._moments[0].time_s < self.config.window_s - ROUNDING_S:
            return False
        commanded_m, commanded_rad = self._commanded(seen.time_s)
        if commanded_m < self.config.min_commanded_m and commanded_rad < self.config.min_commanded_rad:
            return False
        start = self._moments[0]
        if self._stood_still(seen.odom_from_robot):
            return True
        moved = start.odom_from_robot.inverse() @ seen.odom_from_robot
        if (
            math.hypot(moved.x_m, moved.y_m) < self.config.slipped_m
            and abs(moved.yaw_rad) < self.config.slipped_rad
        ):
            return False
        if _is_a_jump(moved, commanded_m, commanded_rad):
            return False
        return self._view_stayed(start.scan, seen, moved)

    def _commanded(self, now_s: float) -> tuple[float, float]:
        """Driving (m) and turning (rad) commanded over the window, whatever the direction."""
        ends = [*[m.time_s for m in self._moments][1:], now_s]
        spans = [(m.twist, end - m.time_s) for m, end in zip(self._moments, ends, strict=True)]
        return (
            sum(abs(twist.linear_mps) * dt for twist, dt in spans),
            sum(abs(twist.angular_radps) * dt for twist, dt in spans),
        )

    def _stood_still(self, odom_from_robot: Pose2) -> bool:
        """Whether all the window's poses are where the robot is now; the oldest, most different, first."""
        return all(self._is_same_place(m.odom_from_robot, odom_from_robot) for m in self._moments)

    def _is_same_place(self, a: Pose2, b: Pose2) -> bool:
        return (
            a.distance_to(b) < self.config.still_m
            and abs(wrap_angle(a.yaw_rad - b.yaw_rad)) < self.config.still_rad
        )

    def _view_stayed(self, before: Scan, seen: Observation, moved: Pose2) -> bool:
        """Whether the wheels slip: the view is the same, though odometry's motion would have changed it."""
        now = seen.scan
        if len(before.ranges_m) != len(now.ranges_m) or len(now.ranges_m) < FEWEST_BEAMS:
            return False
        if self._share_same(before.ranges_m, now.ranges_m) < self.config.same_share:
            return False
        predicted = _ranges_after(before, seen.robot_from_lidar.inverse() @ moved @ seen.robot_from_lidar)
        return self._share_same(before.ranges_m, predicted) < 0.5 * self.config.same_share

    def _share_same(self, before: np.ndarray, after: np.ndarray) -> float:
        both = np.flatnonzero(np.isfinite(before) & np.isfinite(after))
        if len(both) < LEAST_SHARE * len(before):
            return 0.0
        before, after = before[both], after[both]
        is_same = np.abs(after - before) < self.config.same_range_m + SAME_RANGE_SHARE * before
        return np.count_nonzero(is_same) / len(both)


def _is_a_jump(moved: Pose2, commanded_m: float, commanded_rad: float) -> bool:
    """Whether odometry moved far more than was commanded: set anew, it says nothing about the wheels."""
    far = math.hypot(moved.x_m, moved.y_m) > 2.0 * commanded_m + JUMP_M
    return far or abs(moved.yaw_rad) > 2.0 * commanded_rad + JUMP_RAD


def _ranges_after(scan: Scan, old_from_new: Pose2) -> np.ndarray:
    """(n,) ranges that the points of a scan would have from a new pose, nan where no point falls."""
    points = old_from_new.inverse().apply(scan.hits_in_lidar())
    bearings = np.unwrap(scan.bearings_rad)  # a turning lidar's, undistorted, may begin on either side of pi
    step = (bearings[-1] - bearings[0]) / (len(bearings) - 1)
    angles = np.arctan2(points[:, 1], points[:, 0])
    beam = np.round((angles - bearings[0]) / step).astype(int) % max(1, round(2 * np.pi / abs(step)))
    inside = beam < len(bearings)
    ranges = np.full(len(bearings), np.inf)
    np.minimum.at(ranges, beam[inside], np.hypot(points[inside, 0], points[inside, 1]))
    return np.where(np.isfinite(ranges), ranges, np.nan)
