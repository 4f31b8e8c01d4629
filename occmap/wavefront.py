"""What a search leaves behind: the cost to every cell it reached, and the way there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Cells
from occmap.path import Path
from occmap.search import SearchMemory
from occmap.terrain import Terrain


@dataclass(frozen=True, eq=False)
class Wavefront:
    """The cost from the robot to every cell in reach. Valid until the planner searches again."""

    start_cell: tuple[int, int]
    """Where the wave began: the robot's cell, or the nearest from which the body can move on."""
    terrain: Terrain
    escape_cells: NDArray[np.int32]
    """(k,) flat, from the robot's cell to start_cell, where no path may start in the robot's: too close to an
    obstacle, or on an island made by noise; else none."""
    escape_radius_m: float
    exact_below: int
    memory: SearchMemory
    search_number: int

    @property
    def start_in_map(self) -> tuple[float, float]:
        """The centre of the start cell."""
        return self.terrain.frame.centre_of(*self.start_cell)

    @property
    def is_exhausted(self) -> bool:
        """Whether everything in reach was flooded, and no bound or last target ended the search."""
        from occmap.planner_kernels import UNREACHED

        return self.exact_below == UNREACHED

    def check(self) -> None:
        """Raise ValueError if the wave is void."""
        if self.search_number != self.memory.search_number:
            raise ValueError(
                "this wavefront is void: its planner has searched since. Read it before, or flood again"
            )

    @property
    def n_reached(self) -> int:
        """How many cells the wave has touched."""
        self.check()
        return self.memory.n_touched

    def raw_costs(self, within_m: float = math.inf) -> tuple[NDArray[np.int32], int]:
        """Costs as the search keeps them, and the bound below which a cell is in reach: of all that the wave
        has come to, or of what costs no more than within_m.

        Costs (ny, nx) are integers, planner_kernels.STRAIGHT to a cell of free floor (see `metres`); no copy.
        ValueError, here and below, if the wave is void.
        """
        from occmap.planner_kernels import STRAIGHT

        self.check()
        below = within_m / self.terrain.frame.resolution_m * STRAIGHT
        return self.memory.cost.reshape(self.terrain.shape), int(min(self.exact_below, below))

    def metres(self, cost: int) -> float:
        """Metres, dearer near walls, for one of the raw costs."""
        from occmap.planner_kernels import STRAIGHT

        return float(cost) * self.terrain.frame.resolution_m / STRAIGHT

    def reached_cells(self) -> NDArray[np.int32]:
        """(k,) flat indices of the cells in reach."""
        self.check()
        touched = self.memory.touched[: self.memory.n_touched]
        return touched[self.memory.cost[touched] < self.exact_below]

    def cost_at(self, cells: Cells) -> NDArray[np.float32]:
        """(n,) metres to cells (ix, iy), dearer near walls; inf out of reach and outside the grid."""
        self.check()
        inside, flat = self._flat(cells)
        return np.where(inside, self._metres(self.memory.cost[flat]), np.float32(np.inf))

    def cells_to(self, cell: tuple[int, int]) -> NDArray[np.int32] | None:
        """(k,) flat indices of the way from the start to a cell (ix, iy), both ends; None if out of reach."""
        from occmap.planner_kernels import walk_back

        if not np.isfinite(self.cost_at(np.array([cell]))[0]):
            return None
        flat, start = self.terrain.flat(cell), self.terrain.flat(self.start_cell)
        return walk_back(flat, self.terrain.shape[1], self.memory.link, start)

    def length_to_m(self, cell: tuple[int, int]) -> float:
        """Metres of the way from the start to a cell (ix, iy), from cell to cell; inf if out of reach."""
        cells = self.cells_to(cell)
        if cells is None:
            return math.inf
        steps = np.diff(np.divmod(cells.astype(np.int64), self.terrain.shape[1]))
        return float(np.hypot(*steps).sum()) * self.terrain.frame.resolution_m

    def path_to(self, cell: tuple[int, int]) -> Path | None:
        """The cheapest path to a cell (ix, iy), shortened by line of sight; None if out of reach."""
        cells = self.cells_to(cell)
        if cells is None:
            return None
        cost_m = float(self.cost_at(np.array([cell]))[0])
        return self.terrain.path(cells, cost_m, self.escape_cells, self.escape_radius_m)

    def _flat(self, cells: Cells) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        ix, iy = cells[:, 0], cells[:, 1]
        inside = (ix >= 0) & (iy >= 0) & (ix < self.terrain.shape[1]) & (iy < self.terrain.shape[0])
        return inside, np.where(inside, iy * self.terrain.shape[1] + ix, 0)

    def _metres(self, cost: NDArray[np.int32]) -> NDArray[np.float32]:
        from occmap.planner_kernels import STRAIGHT

        scale = np.float32(self.terrain.frame.resolution_m / STRAIGHT)
        return np.where(cost < self.exact_below, cost * scale, np.float32(np.inf))
