"""The first look: until the robot moves, its scans show one view, and their mean says where the map lies."""

from __future__ import annotations

import math
from dataclasses import dataclass

from occmap.config_checks import Positive
from occmap.geometry import Pose2
from occmap.localization.long_look import LongLook
from occmap.localization.matcher import Match, Matcher, by_chance
from occmap.localization.submap import Submap
from occmap.localization.surfel_map import Cloud
from occmap.scan import Scan


@dataclass(frozen=True)
class FirstLookConfig(Positive):
    """How long the robot counts as standing where it was put."""

    first_scans: int = 30
    """Until the robot first moves, at most so many are averaged: the map's frame hangs on their mean."""
    still_m: float = 0.003
    """The wheels stand while they have not gone farther than this from the start: encoders flicker."""
    still_rad: float = 0.004
    """Nor turned farther."""
    still_fit_m: float = 0.04
    """And the scans agree that nothing moved, to the noise of both ends."""
    still_fit_rad: float = 0.02
    """The same, of their turn."""
    still_doubts: int = 1
    """So many scans in a row may contradict wheels that stand, if at the start they fit as well: beside one
    other scan, and before the wheels are known to count at all, one fits anywhere along parallel walls."""
    poor_fit: float = 0.5
    """A scan that fits as badly as this, far and noisy walls in a wide hall, contradicts the wheels only"""
    still_poor_m: float = 0.15
    """if it is off by more than this,"""
    still_poor_rad: float = 0.06
    """or turned by more."""


class FirstLook:
    """Collects what the robot sees from the map's origin, and tells when it has left it."""

    def __init__(self, config: FirstLookConfig, matcher: Matcher) -> None:
        self.config = config
        self.is_over = False
        """Whether the robot has moved at all."""
        self._matcher = matcher
        self._gone = Pose2.identity()  # the wheels' word since the start
        self._doubts = 0  # scans in a row that see the robot elsewhere while the wheels stand
        self._looks: LongLook

    def __len__(self) -> int:
        """How many scans are averaged."""
        return len(self._looks)

    def begin(self, scan: Scan, robot_from_lidar: Pose2) -> None:
        """Start with the very first scan."""
        self._looks = LongLook(scan, robot_from_lidar)

    def goes_on(self, step: Pose2, match: Match, cloud: Cloud, start: Submap) -> bool:
        """Whether the robot, one step of the wheels later, still stands at the start; if not, it is over.

        match: of the scan, a cloud, to the submap of the start.
        """
        self.is_over = not (self.wheels_stand(step) and self._scan_stands(match, cloud, start))
        self._gone = self._gone @ step
        return not self.is_over

    def wheels_stand(self, step: Pose2) -> bool:
        """Whether the wheels, one step of theirs later, have done no more than flicker since the start."""
        return not self.is_over and is_within(self._gone @ step, self.config.still_m, self.config.still_rad)

    def _scan_stands(self, match: Match, cloud: Cloud, start: Submap) -> bool:
        """Whether the scan does not see the robot anywhere but at the start, or not clearly so."""
        c = self.config
        near_m, near_rad = c.still_fit_m, c.still_fit_rad
        if match.fit < c.poor_fit:
            near_m, near_rad = c.still_poor_m, c.still_poor_rad
        if is_within(match.submap_from_robot, near_m, near_rad):
            self._doubts = 0
            return True
        self._doubts += 1
        gain = match.fit - self._matcher.fit_at(cloud, start, Pose2.identity())
        return self._doubts <= c.still_doubts and gain < by_chance(cloud)

    def add(self, scan: Scan) -> bool:
        """Average one more scan, if wanted; whether the mean is worth taking over: at 2, 4, 8, ..."""
        looks = len(self._looks)
        is_wanted = looks < self.config.first_scans and self._doubts == 0
        return is_wanted and self._looks.add(scan) and (looks + 1) & looks == 0

    def mean(self, reach_m: float) -> Cloud:
        """The cloud that all looks are samples of, in the robot's frame, as far as points are matched."""
        return Cloud.of(self._looks.mean(), self._looks.robot_from_lidar, reach_m)


def is_within(step: Pose2, metres: float, rad: float) -> bool:
    """Whether a step goes no farther, and turns no farther, than this."""
    return math.hypot(step.x_m, step.y_m) <= metres and abs(step.yaw_rad) <= rad
