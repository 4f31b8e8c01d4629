"""A MuJoCo model whose geoms are rewritten in place, only for ray casts."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.geom_slots import write_geoms
from sim.solids import Floats, SolidArrays


class RaySlots:
    """A world of `capacity` static geoms, of which the first `used` are there.

    Writing a slot sets by hand what MuJoCo's compiler and kinematics would: nothing is compiled again until a
    larger capacity is needed. A test holds it against a model that was compiled.
    """

    def __init__(self, capacity: int) -> None:
        spec = mujoco.MjSpec()
        for _ in range(capacity):
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 1.0])
        self.capacity = capacity
        self.used = 0
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)
        # The bounding volume of the world's own geoms is used to skip them all: let it hold every building.
        self._model.bvh_aabb[self._model.body_bvhadr[0]] = (0.0, 0.0, 0.0, 1e6, 1e6, 1e6)

    def with_room(self, count: int) -> RaySlots:
        """These slots, or more of them: empty ones, with something to spare."""
        return self if count <= self.capacity else RaySlots(2 * count)

    def write(self, first: int, solids: SolidArrays) -> None:
        """Put solids into the slots from `first` on; those behind them are no longer there."""
        model, data = self._model, self._data
        end = first + len(solids)
        model.body_geomnum[0] = self.used = end
        if first == end:
            return
        write_geoms(model, data, slice(first, end), solids)

    def cast(
        self, origin_m: tuple[float, float, float], directions: Floats, cutoff_m: float
    ) -> tuple[Floats, NDArray[np.int32]]:
        """Distances along (n, 3) directions and the slots that were struck, both -1 for a miss."""
        count = len(directions)
        distance, slot = np.empty(count), np.empty(count, dtype=np.int32)
        mujoco.mj_multiRay(
            self._model,
            self._data,
            pnt=np.array(origin_m),
            vec=directions.ravel(),
            geomgroup=None,
            flg_static=True,
            bodyexclude=-1,  # none
            geomid=slot,
            dist=distance,
            normal=None,
            nray=count,
            cutoff=cutoff_m,
        )
        return distance, slot
