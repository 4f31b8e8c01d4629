"""What one scan shows near the robot, and where that lets it go: exact to the lidar's noise, not to cells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.clearance import clearance_at
from occmap.geometry import Points, Pose2, Twist2
from occmap.grid import OccupancyGrid
from occmap.scan import Scan

NEAR_CELLS = 1.5
"""The map confirms a lone return if it has something within so many cells: in the next one, aslant."""
BACK_M = 0.1
"""So far behind the robot the map is asked whether it may back."""


@dataclass(frozen=True)
class SurroundingsConfig:
    """How a scan is read for driving."""

    reach_m: float = 1.5
    """Farther returns say nothing about the next second."""
    same_surface_m: float = 0.10
    """Neighbouring beams whose ranges differ by less lie on one surface; their noise is averaged."""
    neighbours: int = 3
    """Beams looked at on either side."""

    def __post_init__(self) -> None:
        if not (self.reach_m > 0.0 and self.same_surface_m > 0.0 and self.neighbours >= 1):
            raise ValueError(
                "reach_m and same_surface_m must be positive and neighbours at least 1, got "
                f"{self.reach_m}, {self.same_surface_m} and {self.neighbours}"
            )


@dataclass(frozen=True)
class Base:
    """What a base is and can do."""

    safe_m: float
    """Its axis stays this far from everything."""
    acceleration_mps2: float
    turn_acceleration_radps2: float


class Surroundings:
    """The scan's points near the robot, in its frame. Remembers the last look only."""

    def __init__(self, base: Base, config: SurroundingsConfig | None = None) -> None:
        from occmap import surroundings_kernels  # compiled on first use, not on import

        self.config = config or SurroundingsConfig()
        self.base = base
        self.hits: Points = np.empty((0, 2))
        self._kernels = surroundings_kernels
        self._hits, self._lone = np.empty((0, 2)), np.empty((0, 2))
        self._seen_from: Pose2 = Pose2.identity()
        self._map: tuple[OccupancyGrid, NDArray[np.float32]] | None = None

    @property
    def can_stop_from_mps(self) -> float:
        """Speed from which the base comes to a stop within what is looked at, just."""
        return math.sqrt(2.0 * self.base.acceleration_mps2 * max(self.config.reach_m - self.base.safe_m, 0.0))

    def look(
        self,
        scan: Scan,
        robot_from_lidar: Pose2,
        map_from_robot: Pose2,
        grid: OccupancyGrid,
        clearance_m: NDArray[np.float32],
    ) -> None:
        """Take in a scan. A return that no other beam confirms counts only where the map has something."""
        c, n = self.config, len(scan.ranges_m)
        if len(self._hits) < n:
            self._hits, self._lone = np.empty((n, 2)), np.empty((n, 2))
        n_hits, n_lone = self._kernels.near_hits(
            scan.ranges_m, scan.bearings_rad, scan.least_range_m, scan.max_range_m,
            c.reach_m, c.same_surface_m, c.neighbours,
            *robot_from_lidar.numbers(), self._hits, self._lone,
        )  # fmt: skip
        cell_m = grid.frame.resolution_m
        n_hits = self._kernels.keep_believed(
            self._lone, n_lone, self._hits, n_hits,
            *map_from_robot.numbers(), clearance_m, *grid.frame.origin_m, cell_m, NEAR_CELLS * cell_m,
        )  # fmt: skip
        self.hits = self._hits[:n_hits]
        self._seen_from, self._map = map_from_robot, (grid, clearance_m)

    def is_free(self, twist: Twist2, command: Twist2, hold_s: float) -> bool:
        """Whether a command, held and then braked from, keeps the base safe, or no less safe than it is.

        Backwards the map is asked too: not every lidar looks behind.
        """
        b = self.base
        if command.linear_mps < 0.0 and self._map_clearance_m(-BACK_M) < min(
            self._map_clearance_m(0.0), b.safe_m
        ):
            return False
        return self._kernels.is_free(
            twist.linear_mps, twist.angular_radps, command.linear_mps, command.angular_radps, hold_s,
            b.acceleration_mps2, b.turn_acceleration_radps2, self.hits, b.safe_m,
        )  # fmt: skip

    def free_bearing(self, bearing_rad: float, widest_rad: float, ahead_m: float) -> float | None:
        """The direction nearest to a bearing, at most widest_rad off, in which ahead_m are free."""
        free = self._kernels.free_bearing(bearing_rad, widest_rad, ahead_m, self.hits, self.base.safe_m)
        return None if math.isnan(free) else free

    def _map_clearance_m(self, ahead_m: float) -> float:
        """The map's clearance ahead of the robot, 0 outside the map."""
        if self._map is None:
            return 0.0
        grid, clearance_m = self._map
        return clearance_at(self._seen_from @ Pose2(ahead_m, 0.0, 0.0), grid, clearance_m)
