"""Doors that close while a robot is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim.building import Door
from sim.solids import Floats, SolidArrays
from sim.truth import LIDAR_HEIGHT_M

RISE_MPS = 1.0
KEEP_OFF_M = 0.3
"""Between the body and a panel that rises."""


class ClosingDoors:
    """Panels that rise out of the floor like bollards, and stay up.

    A panel takes about a second, and never rises into the robot: while the body is closer than KEEP_OFF_M,
    it waits where it stands if the lidar sees it, and drops back into the floor if not. So whatever the robot
    can touch, it can see.
    """

    def __init__(self, doors: Sequence[Door]) -> None:
        self._panels = SolidArrays.of([door.panel for door in doors])
        self.height_m: Floats = np.zeros(len(doors))  # (n,) how far each stands out of the floor
        self.standing = self._panels.take(np.zeros(0, dtype=np.int64))

    @property
    def all_closed(self) -> bool:
        """Whether every panel is all the way up."""
        return bool(np.all(self.height_m >= self._panels.height_m))

    def advance(self, dt_s: float, x_m: float, y_m: float, body_radius_m: float) -> None:
        """Raise what may rise and drop what must, with the robot's body standing at a place."""
        in_the_way = self._panels.distance_m(x_m, y_m) < body_radius_m + KEEP_OFF_M
        raised = np.minimum(self.height_m + RISE_MPS * dt_s, self._panels.height_m)
        kept = np.where(self.height_m > LIDAR_HEIGHT_M, self.height_m, 0.0)
        self.height_m = np.where(in_the_way, kept, raised)
        up = np.flatnonzero(self.height_m > 0.0)
        self.standing = replace(self._panels.take(up), height_m=self.height_m[up])


def doors_to_close(doors: Sequence[Door], numbers: Sequence[int]) -> list[Door]:
    """The doors with these numbers; all of them, if none is named."""
    for number in numbers:
        if number >= len(doors):
            raise ValueError(f"no door number {number}: the building has {len(doors)}, numbered from 0")
    return [doors[number] for number in numbers] if numbers else list(doors)
