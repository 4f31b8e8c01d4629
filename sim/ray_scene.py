"""Ray casts against the solids near one place, at a cost that does not grow with the building."""

from __future__ import annotations

import math

import numpy as np

from sim.ray_slots import RaySlots
from sim.solids import Floats, Nearby, SolidArrays


class RayScene:
    """The solids in reach of a lidar, in small MuJoCo models that are only for ray casts.

    `mj_multiRay` tests every ray against every geom of its model, so a lidar that casts against a whole
    building pays for walls it could never see. Here the turn is cut into sectors. Each has a model of its own
    that holds what can be seen in it, refilled as the lidar moves, and turned to look along +x: a solid
    across -x, where azimuths jump, would be tried in full by every ray. The robot is in none of these models
    and cannot see itself.
    """

    def __init__(self, solids: SolidArrays, reach_m: float, sectors: int = 4) -> None:
        self._reach_m = reach_m
        self._nearby = Nearby(solids, reach_m)
        self._width_rad = 2.0 * math.pi / sectors
        self._sectors = [_Sector(k * self._width_rad, self._width_rad) for k in range(sectors)]

    def cast(self, origin_m: tuple[float, float, float], angles_rad: Floats, panels: SolidArrays) -> Floats:
        """(n,) metres along each of (n,) level directions to the first solid, inf where none is in reach.

        `panels` are solids that come and go: they are seen as they stand now.
        """
        self._nearby.around(origin_m[0], origin_m[1])
        turns = np.rint(angles_rad / self._width_rad)
        directions = _level(angles_rad - turns * self._width_rad)
        sector_of = turns.astype(np.int64) % len(self._sectors)
        distance = np.empty(len(angles_rad))
        for number, sector in enumerate(self._sectors):
            beams = np.flatnonzero(sector_of == number)
            if len(beams):
                sector.fill(self._nearby, panels)
                distance[beams] = sector.cast(origin_m, directions[beams], self._reach_m)
        # The cutoff prunes whole geoms and does not clip ranges; a miss is -1.
        distance[(distance < 0.0) | (distance > self._reach_m)] = math.inf
        return distance


class _Sector:
    """A wedge of directions, in a frame turned so that its middle is +x."""

    def __init__(self, middle_rad: float, width_rad: float) -> None:
        self._middle_rad = middle_rad
        self._axis = (math.cos(middle_rad), math.sin(middle_rad))
        self._edge = (math.cos(0.5 * width_rad), math.sin(0.5 * width_rad))
        self._slots = RaySlots(32)
        self._near: SolidArrays | None = None
        self._statics = 0

    def fill(self, nearby: Nearby, panels: SolidArrays) -> None:
        """Hold what stands in the wedge, seen from anywhere in the neighbourhood."""
        if nearby.near is not self._near:
            self._near = nearby.near
            seen = self._in_view(nearby)
            self._statics = len(seen)
            self._slots = self._slots.with_room(self._statics)
            self._slots.write(0, seen)
        if len(panels) or self._slots.used > self._statics:
            self._slots = self._slots.with_room(self._statics + len(panels))
            self._slots.write(self._statics, panels.turned(-self._middle_rad))

    def cast(self, origin_m: tuple[float, float, float], directions: Floats, cutoff_m: float) -> Floats:
        """(n,) distances along (n, 3) unit vectors of the sector's frame, -1 for a miss."""
        x_m, y_m, height_m = origin_m
        return self._slots.cast((*self._turned(x_m, y_m), height_m), directions, cutoff_m)

    def _turned(self, x_m: float, y_m: float) -> tuple[float, float]:
        c, s = self._axis
        return c * x_m + s * y_m, c * y_m - s * x_m

    def _in_view(self, nearby: Nearby) -> SolidArrays:
        """The solids not wholly beyond one of the wedge's edges, wherever the lidar may move until the next
        filling."""
        turned = nearby.near.turned(-self._middle_rad)
        x_m, y_m = self._turned(*nearby.found_at)
        c, s = self._edge
        left = turned.farthest_along(s, -c) - (s * x_m - c * y_m) > -nearby.refill_m
        right = turned.farthest_along(s, c) - (s * x_m + c * y_m) > -nearby.refill_m
        return turned.take(np.flatnonzero(left & right))


def _level(angles_rad: Floats) -> Floats:
    """(n, 3) unit vectors in the plane."""
    vectors = np.zeros((len(angles_rad), 3))
    np.cos(angles_rad, out=vectors[:, 0])
    np.sin(angles_rad, out=vectors[:, 1])
    return vectors
