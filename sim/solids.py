"""All solids of a building as arrays: which are near a place, and how far."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.building import Box, Cylinder, Solid

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class SolidArrays:
    """Upright solids on the floor, `world` frame. Each is a turned rectangle grown by a radius:
    a box has radius 0, a cylinder has half sizes 0."""

    center_m: Floats  # (n, 2)
    half_m: Floats  # (n, 2)
    heading: Floats  # (n, 2) cosine and sine of the yaw
    radius_m: Floats  # (n,)
    height_m: Floats  # (n,)

    @staticmethod
    def of(solids: Sequence[Solid]) -> SolidArrays:
        """The same solids, in the same order."""
        rows = np.array([_row(solid) for solid in solids], dtype=np.float64).reshape(-1, 7)
        yaw = rows[:, 4]
        return SolidArrays(
            np.ascontiguousarray(rows[:, 0:2]),
            np.ascontiguousarray(rows[:, 2:4]),
            np.column_stack((np.cos(yaw), np.sin(yaw))),
            np.ascontiguousarray(rows[:, 5]),
            np.ascontiguousarray(rows[:, 6]),
        )

    def __len__(self) -> int:
        return len(self.radius_m)

    def take(self, which: Indices) -> SolidArrays:
        """The chosen ones, in the order of their numbers."""
        return SolidArrays(
            self.center_m[which],
            self.half_m[which],
            self.heading[which],
            self.radius_m[which],
            self.height_m[which],
        )

    def distance_m(self, x_m: float, y_m: float) -> Floats:
        """(n,) horizontal distance from a place to each solid's surface: exact outside, 0 inside a box,
        negative inside a cylinder."""
        dx, dy = x_m - self.center_m[:, 0], y_m - self.center_m[:, 1]
        c, s = self.heading[:, 0], self.heading[:, 1]
        along = np.maximum(np.abs(c * dx + s * dy) - self.half_m[:, 0], 0.0)
        across = np.maximum(np.abs(c * dy - s * dx) - self.half_m[:, 1], 0.0)
        return np.hypot(along, across) - self.radius_m


class Nearby:
    """The few solids around a moving place, found anew only after it has moved by refill_m."""

    def __init__(self, solids: SolidArrays, reach_m: float, refill_m: float = 1.0) -> None:
        self.refill_m = refill_m
        self.found_at = (math.inf, math.inf)
        self.near = solids
        self._solids = solids
        self._reach_m = reach_m

    def around(self, x_m: float, y_m: float) -> SolidArrays:
        """At least all solids that come nearer than reach_m; the same object until they are found anew."""
        if math.hypot(x_m - self.found_at[0], y_m - self.found_at[1]) > self.refill_m:
            near = self._solids.distance_m(x_m, y_m) < self._reach_m + self.refill_m
            self.near = self._solids.take(np.flatnonzero(near))
            self.found_at = (x_m, y_m)
        return self.near


def _row(solid: Solid) -> tuple[float, ...]:
    if isinstance(solid, Box):
        return solid.x_m, solid.y_m, solid.half_x_m, solid.half_y_m, solid.yaw_rad, 0.0, solid.height_m
    if isinstance(solid, Cylinder):
        return solid.x_m, solid.y_m, 0.0, 0.0, 0.0, solid.radius_m, solid.height_m
    raise ValueError(f"a solid is a Box or a Cylinder, got {solid!r}")
