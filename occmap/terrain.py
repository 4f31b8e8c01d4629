"""Where the body may go and what it costs: the belief and its clearance, read through a price list."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Belief, GridFrame, OccupancyGrid
from occmap.path import Path

ESCAPE_ROOM_M = 0.2
"""On the way out of where no path may start, more clearance than this is not worth a detour."""
ESCAPE_WALL_WEIGHT = 5.0
"""A metre right beside an obstacle counts for so many there."""
FLOAT32_SLACK_M = 1e-4
"""A clearance (float32) that is less than a limit by no more than this is up to it."""
FLOAT64_SLACK_M = 1e-9
"""The same, between float64."""


@dataclass(frozen=True)
class ClearanceLimits:
    """Clearances that tell comfortable, tight and void paths apart.

    Metres from a cell's centre to the nearest occupied cell.
    """

    comfortable_m: float
    """Paths stay this far away wherever they can."""
    comfortable_keep_m: float
    """A comfortable path is void below this."""
    tight_m: float
    """Narrow gaps are passed down to this, at a high price."""
    tight_keep_m: float
    """A path through a narrow gap is void below this."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """One look at the map. Views, not copies: it is as fresh as the arrays."""

    frame: GridFrame
    state: NDArray[np.uint8]  # (ny, nx)
    clearance_m: NDArray[np.float32]  # (ny, nx)
    prices: NDArray[np.int32]  # (3 * bins,), see planner_kernels
    limits: ClearanceLimits
    closed: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    """(k,) flat cells that are not to be entered, whatever the map says."""

    @staticmethod
    def of(
        grid: OccupancyGrid,
        clearance_m: NDArray[np.float32],
        prices: NDArray[np.int32],
        limits: ClearanceLimits,
        closed: NDArray[np.int32],
    ) -> Terrain:
        """A grid as it is now, with its clearance (ny, nx); ValueError if that is of another shape."""
        if clearance_m.shape != grid.shape:
            raise ValueError(
                f"clearance {clearance_m.shape} must match the grid {grid.shape}: update it first"
            )
        return Terrain(grid.frame, grid.state, clearance_m, prices, limits, closed)

    @property
    def shape(self) -> tuple[int, int]:
        """(ny, nx)"""
        return self.state.shape

    @property
    def metres_per_cost(self) -> float:
        """Metres that one unit of a search's integer cost stands for."""
        from occmap.planner_kernels import STRAIGHT

        return self.frame.resolution_m / STRAIGHT

    def flat(self, cell: tuple[int, int]) -> int:
        """The index of a cell (ix, iy) in the arrays laid flat; ValueError if it lies outside."""
        ix, iy = cell
        ny, nx = self.shape
        if not (0 <= ix < nx and 0 <= iy < ny):
            raise ValueError(f"cell ({ix}, {iy}) lies outside the grid of {nx} x {ny} cells")
        return iy * nx + ix

    def cell(self, flat: int) -> tuple[int, int]:
        """The cell (ix, iy) of a flat index."""
        return int(flat % self.shape[1]), int(flat // self.shape[1])

    @property
    def everywhere(self) -> tuple[int, int, int, int]:
        """The box of all cells (ix0, iy0, ix1, iy1), both ends within."""
        return 0, 0, self.shape[1] - 1, self.shape[0] - 1

    @contextmanager
    def closures(self) -> Iterator[None]:
        """Close cells while a kernel looks for a way, by occupying them: kernels know no third reason."""
        state = self.state.reshape(-1)
        was = state[self.closed]
        state[self.closed] = Belief.OCCUPIED
        try:
            yield
        finally:
            state[self.closed] = was

    def is_open(self, window: tuple[slice, slice]) -> NDArray[np.bool_]:
        """Which cells of a window (rows, columns) the body may enter, in the window's shape."""
        is_free = self.state[window] == Belief.FREE
        return is_free & (self.clearance_m[window] >= np.float32(self.limits.tight_m - FLOAT32_SLACK_M))

    def path(
        self, cells: NDArray[np.int32], cost_m: float, escape_cells: NDArray[np.int32], escape_radius_m: float
    ) -> Path:
        """The path along the cells of a search, straightened, after those that lead to its start."""
        from occmap import planner_kernels as kernels

        nx = self.shape[1]
        with self.closures():
            kept = kernels.shortcut(cells, nx, self.state.ravel(), self.clearance_m.ravel(), self.prices)
        way = np.concatenate((escape_cells[:-1], cells[kept])).astype(np.int64)
        points = self.frame.map_from_cell(np.column_stack((way % nx, way // nx)))
        way_out_m = float(np.hypot(*np.diff(points[: len(escape_cells)], axis=0).T).sum())
        lead_m = max(way_out_m, self._lead(points, escape_radius_m))
        least_m = self.least_clearance(points, lead_m)
        is_comfortable = least_m >= self.limits.comfortable_m - self.frame.resolution_m
        keep_m = self.limits.comfortable_keep_m if is_comfortable else self.limits.tight_keep_m
        keep_m = min(keep_m, least_m)  # a straight line may cut a corner of cells that none of its own is
        return Path.through(points, cost_m, keep_m, lead_m)

    def least_clearance(self, points: NDArray[np.float64], from_m: float) -> float:
        """The least clearance along a polyline (n, 2), from_m along it and on; inf beyond its end."""
        return float(self._sample(points, from_m, 0.0)[1])

    def _lead(self, points: NDArray[np.float64], at_most_m: float) -> float:
        """Metres along a polyline until it is comfortably clear."""
        return min(float(self._sample(points, 0.0, self.limits.comfortable_m)[0]), at_most_m)

    def _sample(self, points: NDArray[np.float64], from_m: float, ample_m: float) -> tuple[float, float]:
        from occmap import planner_kernels as kernels

        x, y = self.frame.origin_m
        resolution = self.frame.resolution_m
        return kernels.least_clearance(
            points, self.clearance_m, self.state, x, y, resolution, from_m, ample_m
        )


def price_list(
    limits: ClearanceLimits, roomy_m: float, wall_weight: float, tight_weight: float
) -> NDArray[np.int32]:
    """(3 * bins,) cost of entering a cell by belief and clearance: free cells only.

    1 from roomy_m on, rising as a parabola to wall_weight at the comfortable limit, tight_weight
    below that, and not at all below the tight limit.
    """
    from occmap.planner_kernels import BINS_PER_M, STRAIGHT

    clearance = np.arange(math.ceil(roomy_m * BINS_PER_M) + 1) / BINS_PER_M
    nearness = np.clip((roomy_m - clearance) / (roomy_m - limits.comfortable_m), 0.0, 1.0)
    weight = 1.0 + (wall_weight - 1.0) * nearness**2
    weight[clearance < limits.comfortable_m - FLOAT64_SLACK_M] = tight_weight
    weight[clearance < limits.tight_m - FLOAT64_SLACK_M] = 0.0
    prices = np.zeros((3, len(clearance)), np.int32)
    prices[Belief.FREE] = np.round(weight * STRAIGHT)
    return prices.ravel()


def escape_price_list() -> NDArray[np.int32]:
    """(3 * bins,) cost of entering a cell on the way out of where no path may start: any but occupied."""
    from occmap.planner_kernels import BINS_PER_M, STRAIGHT

    clearance = np.arange(math.ceil(ESCAPE_ROOM_M * BINS_PER_M) + 1) / BINS_PER_M
    weight = 1.0 + (ESCAPE_WALL_WEIGHT - 1.0) * np.clip(1.0 - clearance / ESCAPE_ROOM_M, 0.0, 1.0)
    prices = np.zeros((3, len(clearance)), np.int32)
    prices[Belief.FREE] = np.round(weight * STRAIGHT)
    prices[Belief.UNKNOWN] = 2 * prices[Belief.FREE]
    return prices.ravel()
