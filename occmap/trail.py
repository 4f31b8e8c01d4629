"""Where the robot has been."""

from __future__ import annotations

import math

import numpy as np

from occmap.barred import Gap
from occmap.geometry import Points, Pose2
from occmap.growing import GrowingArray

SPACING_M = 0.1
"""Places are kept this far apart."""
BEYOND_M = 0.25
"""Who has been so far beyond a gap has come through it,"""
BESIDE_M = 0.12
"""or passed that place so near."""


class Trail:
    """Places on the robot's way, and what follows from them: where it came in it can get out."""

    def __init__(self) -> None:
        self._places = GrowingArray((2,))
        self._last = (math.inf, math.inf)

    @property
    def places_in_map(self) -> Points:
        """(n, 2) places in metres, in the order of the way."""
        return self._places.rows

    def note(self, here: Pose2) -> None:
        """Take in where the robot is, in `map`."""
        if math.dist(self._last, here.position) >= SPACING_M:
            self._places.append(here.position)
            self._last = here.position

    def leads_through(self, gap: Gap) -> bool:
        """Whether the robot has been on the far side of a gap, right behind it. O(places)."""
        away = BEYOND_M * np.array([math.cos(gap.direction_rad), math.sin(gap.direction_rad)])
        off_m = np.hypot(*(self.places_in_map - (gap.in_map + away)).T)
        return bool((off_m < BESIDE_M).any())

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        if len(self._places):
            self.places_in_map[:] = new_map_from_old_map.apply(self.places_in_map)
            self._last = tuple(self.places_in_map[-1].tolist())
