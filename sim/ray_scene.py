"""Ray casts against the solids near one place, at a cost that does not grow with the building."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from sim.solids import Floats, Nearby, SolidArrays

_BOX, _CYLINDER = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_CYLINDER)


class RayScene:
    """A MuJoCo model that holds only the solids in reach, refilled as the lidar moves.

    `mj_multiRay` tests every ray against every geom of its model, so a lidar that casts against a whole
    building pays for walls it could never see. Here each geom is a slot that is rewritten in place, without
    kinematics, and without compiling anything until more slots are needed. The robot is not in this model and
    cannot see itself.
    """

    def __init__(self, solids: SolidArrays, reach_m: float) -> None:
        self._reach_m = reach_m
        self._nearby = Nearby(solids, reach_m)
        self._written: SolidArrays | None = None
        self._slots = _Slots(64)

    def cast(self, origin_m: tuple[float, float, float], directions: Floats, panels: SolidArrays) -> Floats:
        """(n,) metres along each of (n, 3) unit directions to the first solid, inf where none is in reach.

        `panels` are solids that come and go: they are seen as they stand now.
        """
        self._fill(origin_m[0], origin_m[1], panels)
        distance = self._slots.cast(origin_m, directions, self._reach_m)
        # The cutoff prunes whole geoms and does not clip ranges; a miss is -1.
        distance[(distance < 0.0) | (distance > self._reach_m)] = math.inf
        return distance

    def _fill(self, x_m: float, y_m: float, panels: SolidArrays) -> None:
        near = self._nearby.around(x_m, y_m)
        needed = len(near) + len(panels)
        if needed > self._slots.capacity:
            self._slots = _Slots(2 * needed)
            self._written = None
        if near is not self._written:
            self._slots.write(0, near)
            self._written = near
        self._slots.write(len(near), panels)


class _Slots:
    """A world of `capacity` geoms, of which the first few are in use."""

    def __init__(self, capacity: int) -> None:
        spec = mujoco.MjSpec()
        for _ in range(capacity):
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 1.0])
        self.capacity = capacity
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)
        # The bounding volume of the world's own geoms is used to skip them all: let it hold every building.
        self._model.bvh_aabb[self._model.body_bvhadr[0]] = (0.0, 0.0, 0.0, 1e6, 1e6, 1e6)

    def write(self, first: int, solids: SolidArrays) -> None:
        """Put solids into the slots from `first` on; slots behind them are no longer in use."""
        model, data = self._model, self._data
        end = first + len(solids)
        model.body_geomnum[0] = end
        if first == end:
            return
        slots = slice(first, end)
        is_cylinder = solids.radius_m > 0.0
        half_z = 0.5 * solids.height_m
        box = np.column_stack((solids.half_m + solids.radius_m[:, None], half_z))  # also bounds a cylinder
        model.geom_type[slots] = np.where(is_cylinder, _CYLINDER, _BOX)
        model.geom_size[slots] = box
        model.geom_size[slots, 1] = np.where(is_cylinder, half_z, box[:, 1])
        model.geom_aabb[slots, 3:] = box
        model.geom_rbound[slots] = np.linalg.norm(box, axis=1)
        data.geom_xpos[slots] = np.column_stack((solids.center_m, half_z))
        c, s = solids.heading[:, 0], solids.heading[:, 1]
        matrix = np.zeros((len(solids), 9))
        matrix[:, 0], matrix[:, 1], matrix[:, 3], matrix[:, 4], matrix[:, 8] = c, -s, s, c, 1.0
        data.geom_xmat[slots] = matrix

    def cast(self, origin_m: tuple[float, float, float], directions: Floats, cutoff_m: float) -> Floats:
        """(n,) distances along (n, 3) directions, -1 for a miss."""
        count = len(directions)
        geom = np.empty(count, dtype=np.int32)
        distance = np.empty(count)
        mujoco.mj_multiRay(
            self._model,
            self._data,
            np.array(origin_m),
            directions.ravel(),
            None,  # geoms of every group,
            True,  # static ones too,
            -1,  # of every body
            geom,
            distance,
            None,  # no normals
            count,
            cutoff_m,
        )
        return distance
