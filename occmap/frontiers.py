"""Frontiers: where free space meets the unknown (Yamauchi 1997), kept in step with the map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Belief, Cells, OccupancyGrid
from occmap.lazy_arrays import lazy_zeros
from occmap.mapper import GridChange


@dataclass(frozen=True, slots=True)
class Frontier:
    """A connected edge of the unknown. Its cells are free; its centroid may lie in a wall."""

    cells: Cells  # (n, 2) in the grid's frame of when it was found
    centroid_in_map: tuple[float, float]
    size: int


@dataclass(frozen=True)
class FrontierConfig:
    """Which edges of the unknown count, and how much of an edge is one frontier."""

    ignore_rim: bool = True
    """Unknown cells beside an occupied one (8-neighbours) do not make a frontier: noise flickers along
    walls, and its specks would be chased for ever."""
    ignore_struck: bool = True
    """A cell in which a beam has ended is a surface if beams have ended in two of its 8 neighbours too:
    neither frontier nor unknown, whatever grazed it since. One that was met four times is, in any case."""
    max_extent_m: float = 3.0
    """A longer frontier is cut in halves until none is: a goal should be a place, not a hall's whole edge."""

    def __post_init__(self) -> None:
        if not self.max_extent_m > 0.0:
            raise ValueError(f"max_extent_m must be positive, got {self.max_extent_m}")


class FrontierMap:
    """The frontier cells of a grid and their groups, updated only around cells whose state changed.

    `mask` (ny, nx) uint8 is aligned with the grid's arrays: 1 in frontier cells.
    """

    def __init__(self, config: FrontierConfig | None = None) -> None:
        from occmap import frontier_kernels  # compiled on first use, not on import

        self.config = config or FrontierConfig()
        self.mask: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self._kernels = frontier_kernels
        self._stirred: list[NDArray[np.int32]] = []  # flat cells that became frontier or ceased to be
        self._grouped: NDArray[np.uint8] = np.empty((0, 0), np.uint8)  # 1 in the cells of the groups
        self._groups: list[Frontier] = []
        self._firsts: NDArray[np.int64] = np.empty(0, np.int64)  # a flat cell of each group

    def update(self, grid: OccupancyGrid, change: GridChange) -> None:
        """Take in what the last scan changed."""
        if change.grew or self.mask.shape != grid.shape:
            self.rebuild(grid)
        elif len(change.flat_cells) or len(change.now_struck):
            self._stirred.append(self._update(change.flat_cells, change.now_struck, grid))

    def rebuild(self, grid: OccupancyGrid) -> None:
        """Start afresh from the grid as it is."""
        self.clear(grid)
        self.take_rows(slice(0, grid.shape[0]), grid)

    def clear(self, grid: OccupancyGrid) -> None:
        """Start afresh, as if the grid held no frontier."""
        self.mask, self._grouped = lazy_zeros(grid.shape, np.uint8), lazy_zeros(grid.shape, np.uint8)
        self._stirred, self._groups, self._firsts = [], [], np.empty(0, np.int64)

    def take_rows(self, rows: slice, grid: OccupancyGrid) -> None:
        """Take in the frontiers in some rows of a grid, after `clear`; in any order."""
        self._stirred.append(np.sort(self._update(edge_cells(grid.state, rows), np.empty(0, np.int32), grid)))

    def _update(
        self, changed: NDArray[np.int32], struck: NDArray[np.int32], grid: OccupancyGrid
    ) -> NDArray[np.int32]:
        """Mend the mask around flat cells; those that became frontier or ceased to be."""
        c = self.config
        return self._kernels.update_mask(
            changed, struck, grid.state, grid.hits, self.mask, c.ignore_rim, c.ignore_struck
        )

    def clusters(self, grid: OccupancyGrid, least_m: float = 0.0) -> list[Frontier]:
        """The frontier cells in 8-connected groups, none longer than max_extent_m nor shorter than least_m.

        Groups that nothing has touched since the last call are those of then.
        """
        if self._stirred:
            listed = self._loosen(np.concatenate(self._stirred))
            self._stirred = []
            self._group(listed, grid)
        least = least_m / grid.config.resolution_m
        return [group for group in self._groups if group.size >= least]

    def _loosen(self, stirred: NDArray[np.int32]) -> NDArray[np.int32]:
        """Drop the groups that something has touched; the cells to be grouped anew, and some others."""
        room = np.empty(len(stirred) + sum(group.size for group in self._groups), np.int32)
        n = self._kernels.loosen(self.mask, self._grouped, stirred, room)
        still = np.flatnonzero(self._grouped.ravel()[self._firsts])
        self._groups, self._firsts = [self._groups[k] for k in still], self._firsts[still]
        return room[:n]

    def _group(self, listed: NDArray[np.int32], grid: OccupancyGrid) -> None:
        """Group listed cells, those that are frontier."""
        most = min(self.config.max_extent_m / grid.config.resolution_m, 1e9)
        cells, ends, centroids = self._kernels.cluster(self.mask, self.mask.ravel(), listed, math.ceil(most))
        self._grouped[cells[:, 1], cells[:, 0]] = 1
        start = 0
        for end, (x_m, y_m) in zip(ends.tolist(), grid.frame.map_from_cell(centroids).tolist(), strict=True):
            self._groups.append(Frontier(cells[start:end], (x_m, y_m), end - start))
            start = end
        firsts = cells[np.concatenate(((0,), ends))[:-1]]
        self._firsts = np.concatenate((self._firsts, firsts[:, 1] * self.mask.shape[1] + firsts[:, 0]))


def edge_cells(state: NDArray[np.uint8], rows: slice) -> NDArray[np.int32]:
    """Flat indices of the free cells in some rows that have an unknown 4-neighbour; outside of the array all
    is unknown.
    """
    low, high = max(rows.start - 1, 0), min(rows.stop + 1, len(state))
    near = state[low:high]
    unknown, beside = near == Belief.UNKNOWN, np.ones(near.shape, bool)
    beside[1:-1, 1:-1] = unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
    edge = (beside & (near == Belief.FREE))[rows.start - low : rows.stop - low]
    return (np.flatnonzero(edge) + rows.start * state.shape[1]).astype(np.int32)


def near_to(place: tuple[float, float], frontiers: Sequence[Frontier], reach_m: float) -> list[Frontier]:
    """The frontiers within reach_m of a place as the crow flies, which no way is shorter than; the nearest
    first.
    """
    away_m = [math.dist(place, frontier.centroid_in_map) for frontier in frontiers]
    near = [k for k, distance_m in enumerate(away_m) if distance_m <= reach_m]
    return [frontiers[k] for k in sorted(near, key=away_m.__getitem__)]
