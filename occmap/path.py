"""A way to drive: a polyline through the map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points


@dataclass(frozen=True, eq=False)
class Path:
    """A polyline from where the robot stands to its goal, in the map frame."""

    waypoints_in_map: Points  # (n, 2), n >= 1
    length_m: float
    cost_m: float = 0.0
    """Metres weighted by the soft cost near walls, before it was straightened."""
    keep_clear_m: float = 0.0
    """The path is void where the map's clearance falls below this; less than what it was planned with."""
    escape_m: float = 0.0
    """The first so many metres lead out of a place closer to an obstacle than a path may be planned."""

    def __post_init__(self) -> None:
        if (
            self.waypoints_in_map.ndim != 2
            or self.waypoints_in_map.shape[1] != 2
            or not self.waypoints_in_map.size
        ):
            raise ValueError(f"a path needs waypoints (n, 2) with n >= 1, got {self.waypoints_in_map.shape}")

    @staticmethod
    def through(
        waypoints_in_map: Points, cost_m: float = 0.0, keep_clear_m: float = 0.0, escape_m: float = 0.0
    ) -> Path:
        """The path along (n, 2) waypoints, its length measured."""
        waypoints = np.ascontiguousarray(waypoints_in_map, dtype=np.float64)
        length_m = float(np.hypot(*np.diff(waypoints, axis=0).T).sum())
        return Path(waypoints, length_m, cost_m, keep_clear_m, escape_m)

    @cached_property
    def stations_m(self) -> NDArray[np.float64]:
        """(n,) metres along the path at which each waypoint lies."""
        steps = np.hypot(*np.diff(self.waypoints_in_map, axis=0).T)
        return np.concatenate(((0.0,), np.cumsum(steps)))

    @property
    def goal(self) -> tuple[float, float]:
        """Where it ends."""
        x, y = self.waypoints_in_map[-1]
        return float(x), float(y)
