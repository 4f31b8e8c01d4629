"""Frontiers: where free space meets the unknown (Yamauchi 1997), kept in step with the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Cells, OccupancyGrid
from occmap.mapper import GridChange


@dataclass(frozen=True, slots=True)
class Frontier:
    """A connected edge of the unknown. Its cells are free; its centroid may lie in a wall."""

    cells: Cells  # (n, 2) in the grid's frame of when it was found
    centroid_in_map: tuple[float, float]
    size: int
    viewpoint: tuple[float, float] | None = None  # in map: where the body can stand and look into it


@dataclass(frozen=True)
class FrontierConfig:
    """Which edges of the unknown count, and how much of an edge is one frontier."""

    ignore_rim: bool = True
    """Unknown cells beside an occupied one (8-neighbours) do not make a frontier: noise flickers along
    walls, and its specks would be chased for ever."""
    max_extent_m: float = 3.0
    """A longer frontier is cut in halves until none is: a goal should be a place, not a hall's whole edge."""

    def __post_init__(self) -> None:
        if not self.max_extent_m > 0.0:
            raise ValueError(f"max_extent_m must be positive, got {self.max_extent_m}")


class FrontierMap:
    """The frontier cells of a grid, updated only around cells whose state changed.

    `mask` (ny, nx) uint8 is aligned with the grid's arrays: 1 in frontier cells.
    """

    def __init__(self, config: FrontierConfig | None = None) -> None:
        from occmap import frontier_kernels  # compiled on first use, not on import

        self.config = config or FrontierConfig()
        self.mask: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self._kernels = frontier_kernels
        self._listed: NDArray[np.int32] = np.empty(0, np.int32)  # flat; all frontier cells and some that were

    def update(self, grid: OccupancyGrid, change: GridChange) -> None:
        """Take in what the last scan changed."""
        if change.grew or self.mask.shape != grid.shape:
            self.rebuild(grid)
        elif len(change.flat_cells) or len(change.now_solid):
            changed = np.concatenate((change.flat_cells, change.now_solid))
            ignore_rim = self.config.ignore_rim
            fresh = self._kernels.update_mask(changed, grid.state, grid.hits, self.mask, ignore_rim)
            self._listed = np.concatenate((self._listed, fresh))

    def rebuild(self, grid: OccupancyGrid) -> None:
        """Start afresh from the grid as it is."""
        self.mask = np.zeros(grid.shape, np.uint8)
        self._listed = self._kernels.full_mask(grid.state, grid.hits, self.mask, self.config.ignore_rim)

    def clusters(self, grid: OccupancyGrid, least_m: float = 0.0) -> list[Frontier]:
        """The frontier cells grouped by 8-connectivity, none longer than max_extent_m, without specks."""
        least = least_m / grid.config.resolution_m
        most = min(self.config.max_extent_m / grid.config.resolution_m, 1e9)
        cells, ends, centroids = self._kernels.cluster(self.mask, self._listed, math.ceil(most))
        self._listed = (cells[:, 1] * self.mask.shape[1] + cells[:, 0]).astype(np.int32)
        places = grid.frame.map_from_cell(centroids).tolist()
        found, start = [], 0
        for end, (x_m, y_m) in zip(ends.tolist(), places, strict=True):
            if end - start >= least:
                found.append(Frontier(cells[start:end], (x_m, y_m), end - start))
            start = end
        return found
