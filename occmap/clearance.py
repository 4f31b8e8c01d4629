"""Distance from every cell to the nearest obstacle, kept in step with the map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.grid import Belief, OccupancyGrid
from occmap.lazy_arrays import lazy_zeros
from occmap.mapper import GridChange

FARTHEST_CELLS = 255
"""Distances along a column are kept in a byte each."""


@dataclass(frozen=True)
class ClearanceConfig:
    """How far distances are worth knowing."""

    truncate_m: float = 1.0
    """Distances beyond this read as this: what a planner asks of open space ends here."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.truncate_m) and self.truncate_m > 0.0):
            raise ValueError(f"truncate_m must be positive, got {self.truncate_m}")

    def reaching(self, least_m: float) -> ClearanceConfig:
        """This config, or one that reaches as far as a large body asks."""
        return self if least_m <= self.truncate_m else replace(self, truncate_m=least_m)


def clearance_at(place: Pose2, grid: OccupancyGrid, clearance_m: NDArray[np.float32]) -> float:
    """Metres from a place to the nearest occupied cell, 0 outside of the map."""
    ix, iy = grid.frame.cell_at(*place.position)
    return float(clearance_m[iy, ix]) if grid.contains(ix, iy) else 0.0


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
        self._is_old: NDArray[np.bool_] = np.empty(0, bool)  # (ny,) rows that hold nothing true yet
        self._by_squares: NDArray[np.float32] = np.empty(0, np.float32)
        self._disc: NDArray[np.float32] = np.empty((0, 0), np.float32)

    def update(self, grid: OccupancyGrid, change: GridChange) -> None:
        """Take in what the last scan changed."""
        if change.grew or self.distance_m.shape != grid.shape:
            self.rebuild(grid)
        elif len(change.flat_cells):
            nx = grid.shape[1]
            self._clear_around(int(change.flat_cells.min()) // nx, int(change.flat_cells.max()) // nx + 1)
            self._take_flips(change.flat_cells, change.was, grid)

    def rebuild(self, grid: OccupancyGrid) -> None:
        """Start afresh from the grid as it is."""
        self.clear(grid)
        self.take_rows(slice(0, grid.shape[0]), grid)

    def clear(self, grid: OccupancyGrid) -> None:
        """Start afresh: row by row, as they are taken in."""
        self._by_squares = distance_by_squares(self.config.truncate_m, grid.config.resolution_m)
        radius = self._radius
        offsets = np.arange(-radius, radius + 1)
        squares = offsets[:, None] ** 2 + offsets[None, :] ** 2
        self._disc = self._by_squares[np.minimum(squares, len(self._by_squares) - 1)]
        if self.distance_m.shape != grid.shape:  # else, to write to memory that there is costs a fraction
            self._column = lazy_zeros(grid.shape, np.uint8)
            self.distance_m = lazy_zeros(grid.shape, np.float32)
        self._is_old = np.ones(grid.shape[0], bool)

    def take_rows(self, rows: slice, grid: OccupancyGrid) -> None:
        """Take in the obstacles in some rows of a grid, after `clear`; in any order, each once.

        Until then nothing true is said of those rows: of a larger grid, that all is occupied.
        """
        self._clear_around(rows.start, rows.stop)
        first = rows.start * grid.shape[1]
        occupied = (np.flatnonzero(grid.state[rows] == Belief.OCCUPIED) + first).astype(np.int32)
        self._take_flips(occupied, np.zeros(len(occupied), np.uint8), grid)

    @property
    def _radius(self) -> int:
        """How many cells away an obstacle still shows."""
        return math.isqrt(len(self._by_squares) - 1)

    def _clear_around(self, low: int, stop: int) -> None:
        """Make the old rows near some rows what they are with nothing occupied."""
        near = slice(max(low - self._radius, 0), stop + self._radius)
        is_old = self._is_old[near]
        if is_old.any():
            self._column[near][is_old], self.distance_m[near][is_old] = self._radius, self.config.truncate_m
            is_old[:] = False

    def _take_flips(self, flat_cells: NDArray[np.int32], was: NDArray[np.uint8], grid: OccupancyGrid) -> None:
        layers = self._column, self.distance_m
        self._kernels.take_flips(flat_cells, was, grid.state, *layers, self._by_squares, self._disc)


def radius_cells(truncate_m: float, resolution_m: float) -> int:
    """So many cells from an obstacle the clearance is truncate_m. ValueError if they are too many."""
    radius = math.ceil(truncate_m / resolution_m + 0.5)
    if radius > FARTHEST_CELLS:
        raise ValueError(
            f"truncate_m of {truncate_m} is more than {FARTHEST_CELLS - 1} cells of {resolution_m} m: "
            "lower it"
        )
    return radius


def distance_by_squares(truncate_m: float, resolution_m: float) -> NDArray[np.float32]:
    """(k,) clearance in metres at 0, 1, 2, ... squared cells; the last, truncate_m, is for all beyond.

    From a cell's centre to the near side of an occupied cell. ValueError if that reaches too many cells.
    """
    radius = radius_cells(truncate_m, resolution_m)
    distance_m = (np.sqrt(np.arange(radius * radius + 1)) - 0.5) * resolution_m
    return np.clip(distance_m, 0.0, truncate_m).astype(np.float32)
