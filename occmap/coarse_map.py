"""The map in blocks: where the body has room, and what ways between far places cost, at a glance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier
from occmap.grid import GridFrame
from occmap.search import SearchMemory, SearchRequest
from occmap.terrain import FLOAT32_SLACK_M, Terrain

BLOCK_M = 0.3
"""Side of a block. The body's axis can come no nearer than this to a wall's other side, so that no way leads
through a wall from a block to the next."""
REACH_M = 2.5
"""How far from a frontier a block may lie that stands for it."""
STRAY_CELLS = 2
"""So many unknown cells may lie between a block and what it stands for."""

Blocks = NDArray[np.int64]
"""(n,) flat indices of blocks."""


class CoarseMap:
    """One look at a terrain in blocks; as many searches in it as wanted."""

    def __init__(self, fine: Terrain, memory: SearchMemory) -> None:
        from occmap import tour_kernels

        self.fine = fine
        self.side = max(1, round(BLOCK_M / fine.frame.resolution_m))
        self._memory = memory
        self._kernels = tour_kernels
        shape = -(-fine.shape[0] // self.side), -(-fine.shape[1] // self.side)
        state, clearance_m = np.empty(shape, np.uint8), np.empty(shape, np.float32)
        least_m = np.float32(fine.limits.comfortable_m - FLOAT32_SLACK_M)
        tour_kernels.coarsen(fine.state, fine.clearance_m, self.side, least_m, state, clearance_m)
        frame = GridFrame(fine.frame.resolution_m * self.side, fine.frame.origin_m)
        self.terrain = Terrain(frame, state, clearance_m, fine.prices, fine.limits)
        self._request: tuple[Blocks, SearchRequest] | None = None  # for the blocks last asked for

    def block_near(self, cell: tuple[int, int]) -> int | None:
        """The nearest block in sight of a cell (ix, iy) of the map; None if there is none within REACH_M."""
        reach = int(REACH_M / self.terrain.frame.resolution_m)
        state, coarse = self.fine.state, self.terrain.state
        block = self._kernels.nearest_block(state, coarse, self.side, *cell, reach, STRAY_CELLS)
        return None if block < 0 else int(block)

    def block_of(self, frontier: Frontier) -> int | None:
        """The block that stands for a frontier."""
        away = frontier.cells - frontier.cells.mean(axis=0)
        ix, iy = frontier.cells[np.argmin(np.einsum("ij,ij->i", away, away))].tolist()
        return self.block_near((ix, iy))

    def places_m(self, blocks: Blocks) -> NDArray[np.float64]:
        """(n, 2) where blocks are, counted from the corner of the map."""
        iy, ix = np.divmod(blocks, self.terrain.shape[1])
        return np.column_stack((ix, iy)) * self.terrain.frame.resolution_m

    def cell_in(self, block: int) -> tuple[int, int]:
        """The cell (ix, iy) of the map in a block that the body has most room in."""
        by, bx = divmod(block, self.terrain.shape[1])
        fine = self.fine
        return fine.cell(self._kernels.roomiest_cell(fine.state, fine.clearance_m, self.side, bx, by))

    def costs_from_m(self, start: int) -> NDArray[np.float64]:
        """(ny, nx) metres from one block to all, dearer near walls; inf if no way leads there."""
        flood = SearchRequest.flood(self.terrain, None, None, math.inf)
        exact_below = self._memory.search(self.terrain, start, self.terrain.prices, flood)
        cost = self._memory.cost.reshape(self.terrain.shape)
        return np.where(cost < exact_below, cost * self.terrain.metres_per_cost, np.inf)

    def costs_m(self, start: int, blocks: Blocks) -> NDArray[np.float64]:
        """(n,) metres from one block to others, dearer near walls; inf if no way leads there."""
        if self._request is None or self._request[0] is not blocks:
            cells = np.column_stack((blocks % self.terrain.shape[1], blocks // self.terrain.shape[1]))
            self._request = blocks, SearchRequest.flood(self.terrain, cells, None, math.inf)
        exact_below = self._memory.search(self.terrain, start, self.terrain.prices, self._request[1])
        cost = self._memory.cost[blocks]
        return np.where(cost < exact_below, cost * self.terrain.metres_per_cost, np.inf)
