"""Odometry that says nothing, because there is none or it has died: the localizer tells the way."""

from __future__ import annotations

from dataclasses import replace

from occmap.geometry import Pose2, wrap_angle
from occmap.scan import Observation

SEEN_M, SEEN_RAD = 0.1, 0.2
"""A robot that is seen to have gone or turned this far, while odometry stands to the last bit, has none."""


class SilentOdometry:
    """Watches whether odometry says anything while the localizer sees the robot move.

    Believed, odometry that always stands would have every robot stuck that drives.
    """

    def __init__(self) -> None:
        self._stood: tuple[Pose2, Pose2] | None = None  # odometry; the robot in the map as it did so
        self._is_silent = False

    def made_up_for(self, seen: Observation, here: Pose2) -> Observation:
        """The observation, with the localizer's word for the way if odometry has none."""
        if self._stood is None or seen.odom_from_robot != self._stood[0]:
            self._stood, self._is_silent = (seen.odom_from_robot, here), False
        odom_from_robot, was = self._stood
        self._is_silent = self._is_silent or _has_moved(was, here)
        if not self._is_silent:
            return seen
        return replace(seen, odom_from_robot=odom_from_robot @ was.inverse() @ here)

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        if self._stood is not None:
            odom_from_robot, was = self._stood
            self._stood = odom_from_robot, new_map_from_old_map @ was


def _has_moved(was: Pose2, here: Pose2) -> bool:
    return was.distance_to(here) > SEEN_M or abs(wrap_angle(here.yaw_rad - was.yaw_rad)) > SEEN_RAD
