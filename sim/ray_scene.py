"""Ray casts against the solids in sight, at a cost that does not grow with the building."""

from __future__ import annotations

import math

import numpy as np

from sim.ray_slots import RaySlots
from sim.solids import Floats, Nearby, SolidArrays
from sim.umbra import hidden


class RayScene:
    """The solids that a lidar can see from around a place, in a MuJoCo model that is only for ray casts.

    `mj_multiRay` tests every ray against every geom of its model, so a lidar that casts against a whole
    building pays for walls it could never see. This model holds those that are in reach and not hidden behind
    another, and is refilled as the lidar moves. The robot is not in it and cannot see itself.
    """

    def __init__(self, solids: SolidArrays, reach_m: float, height_m: float) -> None:
        tall = np.flatnonzero(solids.height_m > height_m)  # level rays pass over all others
        self._reach_m = reach_m
        self._height_m = height_m
        self._nearby = Nearby(solids.take(tall), reach_m)
        self._near: SolidArrays | None = None
        self._seen = self._nearby.near
        self._slots = RaySlots(64)

    def cast(self, x_m: float, y_m: float, angles_rad: Floats, panels: SolidArrays) -> Floats:
        """(n,) metres along each of (n,) directions to the first solid, inf where none is in reach.

        `panels` are solids that come and go: they are seen as they stand now.
        """
        self._fill(x_m, y_m, panels)
        directions = np.zeros((len(angles_rad), 3))
        np.cos(angles_rad, out=directions[:, 0])
        np.sin(angles_rad, out=directions[:, 1])
        distance = self._slots.cast((x_m, y_m, self._height_m), directions, self._reach_m)
        # The cutoff prunes whole geoms and does not clip ranges; a miss is -1.
        distance[(distance < 0.0) | (distance > self._reach_m)] = math.inf
        return distance

    def _fill(self, x_m: float, y_m: float, panels: SolidArrays) -> None:
        near = self._nearby.around(x_m, y_m)
        moved = near is not self._near
        if moved:
            out_of_sight = hidden(near, *self._nearby.found_at, self._nearby.refill_m)
            self._near, self._seen = near, near.take(np.flatnonzero(~out_of_sight))
        slots = self._slots.with_room(len(self._seen) + len(panels))
        if moved or slots is not self._slots:
            slots.write(0, self._seen)
        slots.write(len(self._seen), panels)
        self._slots = slots
