"""The solids that a robot could touch soon, in a model that holds no others."""

from __future__ import annotations

import mujoco
import numpy as np

from sim.geom_slots import write_geoms
from sim.scene import SOLID_BIT
from sim.solids import Nearby, SolidArrays

REACH_M = 1.0
"""A robot's radius, what it drives in a moment, and plenty."""
REFILL_M = 0.5


class NearWalls:
    """Static geoms of the worldbody that stand for the solids around the robot, wherever it goes.

    Every static geom costs a step some nanoseconds, however far away it is: 200 of them half as much as the
    robot itself, the 12,000 boxes of a ragged map ten times as much. With as many slots as there are solids
    around the most crowded place, a step costs the same in every building.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, solids: SolidArrays) -> None:
        self._model, self._data = model, data
        self._nearby = Nearby(solids, REACH_M, REFILL_M)
        self._near: SolidArrays | None = None
        self._end = int(model.body_geomadr[0] + model.body_geomnum[0])  # slots are the worldbody's last geoms
        slots = [geom for geom in range(self._end) if model.geom(geom).name.startswith("slot_")]
        self._first = self._end - len(slots)
        model.geom_contype[self._first : self._end] = 0

    def surround(self, x_m: float, y_m: float) -> None:
        """Set up what is around a place; cheap where nothing has changed."""
        near = self._nearby.around(x_m, y_m)
        if near is self._near:
            return
        self._near = near
        used = slice(self._first, self._first + len(near))
        self._model.geom_contype[self._first : self._end] = 0
        self._model.geom_contype[used] = SOLID_BIT
        write_geoms(self._model, self._data, used, near)
        self._model.body_geomnum[0] = used.stop - self._model.body_geomadr[0]  # the others are not there


def most_around_a_place(solids: SolidArrays) -> int:
    """How many solids are around the most crowded place, or a few more: counted on a lattice of a metre."""
    if not len(solids):
        return 0
    c, s = np.abs(solids.heading).T
    half_x, half_y = solids.half_m.T
    extent = np.column_stack((c * half_x + s * half_y, s * half_x + c * half_y))
    extent += solids.radius_m[:, None] + REACH_M + REFILL_M
    low = np.floor(solids.center_m - extent).astype(np.int64)
    high = np.floor(solids.center_m + extent).astype(np.int64) + 1
    counts = np.zeros(high.max(axis=0) - low.min(axis=0), dtype=np.int64)
    low, high = low - low.min(axis=0), high - low.min(axis=0)
    for (x0, y0), (x1, y1) in zip(low.tolist(), high.tolist(), strict=True):
        counts[x0:x1, y0:y1] += 1
    return int(counts.max())
