"""Distance from every cell to the nearest obstacle, kept in step with the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Belief, OccupancyGrid
from occmap.lazy_arrays import filled
from occmap.mapper import GridChange


@dataclass(frozen=True)
class ClearanceConfig:
    """How far distances are worth knowing."""

    truncate_m: float = 1.0
    """Distances beyond this read as this: what a planner asks of open space ends here."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.truncate_m) and self.truncate_m > 0.0):
            raise ValueError(f"truncate_m must be positive, got {self.truncate_m}")


class ClearanceMap:
    """Exact Euclidean distances to the occupied cells, truncated; updated only near cells that flipped.

    `distance_m` (ny, nx) is aligned with the grid's arrays: from a cell's centre to the nearest
    occupied cell's centre less half a cell, 0 in occupied cells, truncate_m where none is near.
    Unknown cells are no obstacles here.
    """

    def __init__(self, config: ClearanceConfig | None = None) -> None:
        from occmap import clearance_kernels  # compiled on first use, not on import

        self.config = config or ClearanceConfig()
        self.distance_m: NDArray[np.float32] = np.empty((0, 0), np.float32)
        self._kernels = clearance_kernels
        self._column: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self._by_squares: NDArray[np.float32] = np.empty(0, np.float32)
        self._disc: NDArray[np.float32] = np.empty((0, 0), np.float32)

    def update(self, grid: OccupancyGrid, change: GridChange) -> None:
        """Take in what the last scan changed."""
        if change.grew or self.distance_m.shape != grid.shape:
            self.rebuild(grid)
        elif len(change.flat_cells):
            self._take_flips(change.flat_cells, change.was, grid)

    def rebuild(self, grid: OccupancyGrid) -> None:
        """Start afresh from the grid as it is."""
        self.clear(grid)
        self.take_rows(slice(0, grid.shape[0]), grid)

    def clear(self, grid: OccupancyGrid) -> None:
        """Start afresh, as if nothing in the grid were occupied."""
        self._by_squares = distance_by_squares(self.config.truncate_m, grid.config.resolution_m)
        radius = math.isqrt(len(self._by_squares) - 1)
        offsets = np.arange(-radius, radius + 1)
        squares = offsets[:, None] ** 2 + offsets[None, :] ** 2
        self._disc = self._by_squares[np.minimum(squares, len(self._by_squares) - 1)]
        if self.distance_m.shape != grid.shape:
            self._column = filled(grid.shape, radius, np.uint8)
            self.distance_m = filled(grid.shape, self.config.truncate_m, np.float32)
        else:  # after a correction: to write to memory that there is costs a fraction
            self._column[...], self.distance_m[...] = radius, self.config.truncate_m

    def take_rows(self, rows: slice, grid: OccupancyGrid) -> None:
        """Take in the obstacles in some rows of a grid, after `clear`; in any order, each once."""
        first = rows.start * grid.shape[1]
        occupied = (np.flatnonzero(grid.state[rows] == Belief.OCCUPIED) + first).astype(np.int32)
        self._take_flips(occupied, np.zeros(len(occupied), np.uint8), grid)

    def _take_flips(self, flat_cells: NDArray[np.int32], was: NDArray[np.uint8], grid: OccupancyGrid) -> None:
        layers = self._column, self.distance_m
        self._kernels.take_flips(flat_cells, was, grid.state, *layers, self._by_squares, self._disc)


def distance_by_squares(truncate_m: float, resolution_m: float) -> NDArray[np.float32]:
    """(k,) clearance in metres at 0, 1, 2, ... squared cells; the last, truncate_m, is for all beyond."""
    radius = math.ceil(truncate_m / resolution_m + 0.5)
    if radius > 255:
        raise ValueError(f"truncate_m of {truncate_m} is more than 254 cells of {resolution_m} m: lower it")
    distance_m = (np.sqrt(np.arange(radius * radius + 1)) - 0.5) * resolution_m
    return np.clip(distance_m, 0.0, truncate_m).astype(np.float32)
