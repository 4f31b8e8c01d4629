"""The belief as square tiles on a lattice that never moves, so that only what changed is recorded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Belief, OccupancyGrid

ROS_FROM_BELIEF: NDArray[np.uint8] = np.array([255, 0, 100], np.uint8)
"""Unknown, free, occupied as in nav_msgs/OccupancyGrid (-1 as a byte is 255)."""


@dataclass(frozen=True)
class Tile:
    """A square of the belief whose content is new."""

    index: tuple[
        int, int
    ]  # which tile of the lattice (column, row); negative left of and below the map's origin
    low_m: tuple[float, float]  # lower-left corner, map frame
    state: NDArray[np.uint8]  # (side, side) values of Belief, row 0 at the lowest y

    def image(self) -> NDArray[np.uint8]:
        """(side, side) ROS occupancy values, row 0 at the top: an image's rows run downwards."""
        return ROS_FROM_BELIEF[self.state[::-1]]


class BeliefTiles:
    """Remembers what was shown of a grid and tells what must be shown anew.

    The grid may grow between calls: tiles are aligned with its lattice, not with its arrays. Costs a
    comparison of the whole belief (0.1 ms a megacell); memory is one byte a cell of the tiles ever shown.
    """

    def __init__(self, side_cells: int = 128) -> None:
        if side_cells < 1:
            raise ValueError(f"side_cells must be positive, got {side_cells}")
        self._side = side_cells
        self._shown: dict[tuple[int, int], NDArray[np.uint8]] = {}

    def changed(self, grid: OccupancyGrid) -> Iterator[Tile]:
        """The tiles that differ from what was handed out before; wholly unknown ones never start to exist."""
        for index in self._indices(grid):
            state = self._cut(grid, index)
            before = self._shown.get(index)
            if np.array_equal(state, before) if before is not None else not state.any():
                continue
            self._shown[index] = state
            pitch_m = self._side * grid.frame.resolution_m
            yield Tile(index, (index[0] * pitch_m, index[1] * pitch_m), state)

    def _indices(self, grid: OccupancyGrid) -> Iterator[tuple[int, int]]:
        (ny, nx), (ox, oy), side = grid.shape, grid.offset, self._side
        for ty in range(oy // side, -(-(oy + ny) // side)):
            for tx in range(ox // side, -(-(ox + nx) // side)):
                yield tx, ty

    def _cut(self, grid: OccupancyGrid, index: tuple[int, int]) -> NDArray[np.uint8]:
        """A copy of one tile; what lies outside the grid's arrays is unknown."""
        side, (ny, nx) = self._side, grid.shape
        x0, y0 = index[0] * side - grid.offset[0], index[1] * side - grid.offset[1]
        inside = grid.state[max(y0, 0) : min(y0 + side, ny), max(x0, 0) : min(x0 + side, nx)]
        tile = np.full((side, side), Belief.UNKNOWN, np.uint8)
        h, w = inside.shape
        tile[max(-y0, 0) : max(-y0, 0) + h, max(-x0, 0) : max(-x0, 0) + w] = inside
        return tile
