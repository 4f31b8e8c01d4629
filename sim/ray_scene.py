"""Ray casts against the solids that matter, at a cost that does not grow with the building."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.foreground import in_front
from sim.ray_slots import RaySlots
from sim.solids import Floats, Nearby, SolidArrays
from sim.umbra import hidden

FEW = 400
"""So many solids are cast against at once; of more, those in front are looked for first."""


class RayScene:
    """The solids that a lidar can see from around a place, in MuJoCo models that are only for ray casts.

    `mj_multiRay` tests every ray against every geom of its model, so a lidar that casts against a whole
    building pays for walls it could never see. Here it casts against what is in reach and not hidden behind
    another wall, found anew as the lidar moves. Where a building comes from a ragged map, that still is
    thousands of boxes: there the solids that the last scan struck bound the ranges of this one, and it casts
    against what is nearer than these bounds. Neither changes any range. The robot is in none of the models
    and cannot see itself.
    """

    def __init__(self, solids: SolidArrays, reach_m: float, height_m: float) -> None:
        tall = np.flatnonzero(solids.height_m > height_m)  # level rays pass over all others
        self._reach_m = reach_m
        self._height_m = height_m
        self._nearby = Nearby(solids.take(tall), reach_m)
        self._near: SolidArrays | None = None
        self._seen = self._nearby.near
        self._struck = np.arange(0)
        self._slots = RaySlots(64)
        self._written: SolidArrays | None = None

    def cast(self, x_m: float, y_m: float, angles_rad: Floats, panels: SolidArrays) -> Floats:
        """(n,) metres along each of (n,) directions to the first solid, inf where none is in reach.

        `panels` are solids that come and go: they are seen as they stand now.
        """
        self._look_around(x_m, y_m)
        directions = np.zeros((len(angles_rad), 3))
        np.cos(angles_rad, out=directions[:, 0])
        np.sin(angles_rad, out=directions[:, 1])
        if len(self._seen) <= FEW:
            return self._cast(x_m, y_m, directions, self._seen, panels)[0]
        bound_m, _ = self._cast(x_m, y_m, directions, self._seen.take(self._struck), panels)
        bound_m = np.minimum(bound_m, self._reach_m)
        front = np.flatnonzero(in_front(self._seen, x_m, y_m, angles_rad, bound_m))
        distance_m, slot = self._cast(x_m, y_m, directions, self._seen.take(front), panels)
        self._struck = front[np.unique(slot[(slot >= 0) & (slot < len(front))])]
        return distance_m

    def _look_around(self, x_m: float, y_m: float) -> None:
        """Find anew what can be seen from about here, if the last place was elsewhere."""
        near = self._nearby.around(x_m, y_m)
        if near is not self._near:
            out_of_sight = hidden(near, *self._nearby.found_at, self._nearby.refill_m)
            self._near, self._seen = near, near.take(np.flatnonzero(~out_of_sight))
            # The nearest stand in for those that a scan from here has struck.
            self._struck = np.argsort(self._seen.distance_m(x_m, y_m), kind="stable")[:FEW]

    def _cast(
        self, x_m: float, y_m: float, directions: Floats, statics: SolidArrays, panels: SolidArrays
    ) -> tuple[Floats, NDArray[np.int32]]:
        """Ranges, and the number of the solid that each beam struck: first statics, then panels, then -1."""
        slots = self._slots.with_room(len(statics) + len(panels))
        if statics is not self._written or slots is not self._slots:
            slots.write(0, statics)
        slots.write(len(statics), panels)
        self._slots, self._written = slots, statics
        distance_m, slot = slots.cast((x_m, y_m, self._height_m), directions, self._reach_m)
        # The cutoff prunes whole geoms and does not clip ranges; a miss is -1.
        distance_m[(distance_m < 0.0) | (distance_m > self._reach_m)] = math.inf
        return distance_m, slot
