"""Perception: from each observation to where the robot is, and a belief in step with what it has seen."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from occmap.geometry import Pose2
from occmap.living_map import LivingMap
from occmap.localization.localizer import Localizer
from occmap.scan import Observation, Scan
from occmap.stopwatch import Stopwatch


class Percept(NamedTuple):
    """What has become of an observation."""

    map_from_robot: Pose2
    seen: Observation
    """With its scan as seen from that one pose."""
    new_map_from_old_map: Pose2 | None
    """If the localizer has corrected the past, and the map with it."""
    is_lost: bool
    """Whether the pose is a guess; nothing is mapped from there."""


class Perception:
    """Localises, and spends scans on the map: at once, or when nobody thinks about it any more."""

    def __init__(self, localizer: Localizer, living_map: LivingMap) -> None:
        self.localizer = localizer
        self.map = living_map
        self._unspent: list[tuple[Scan, Pose2]] = []

    def take_in(self, seen: Observation, watch: Stopwatch, *, is_held: bool, is_over: bool) -> Percept:
        """See; while the map is held only a correction changes it, and scans wait; when all is over, or while
        the robot is lost, none is spent.
        """
        with watch.lap("localization"):
            estimate = self.localizer.update(seen)
        here, correction = estimate.map_from_robot, None
        if estimate.grid is not None:
            correction = estimate.map_shift or Pose2.identity()
            self._unspent.clear()  # the new map knows of them
            self.map.replace(estimate.grid, here)
        elif self.map.is_settling:
            with watch.lap("mapping"):
                self.map.settle()
        if estimate.scan is not None:
            seen = replace(seen, scan=estimate.scan)
        is_spent = not (is_over or estimate.is_lost)
        if is_spent and (estimate.insert or not self.map.holds(here)):
            self._unspent.append((seen.scan, here @ seen.robot_from_lidar))
        if not is_held or correction is not None:
            for scan, map_from_lidar in self._unspent:
                self.map.insert(scan, map_from_lidar, watch)
            self._unspent.clear()
            self.map.make_room(here)
        return Percept(here, seen, correction, estimate.is_lost)
