"""How good a map is: the belief against the truth. The robot never sees any of this.

The belief is read at the centre of each cell of the truth grid, the map placed in the world by the
true start pose alone. With E the explorable cells, the *rim* those of E within one cell (8
neighbours) of a wall (noise and rounding may put a surface on either side of a cell's border, so
there either answer counts), and the visible wall surface W the wall cells within one cell of an
explorable one:

- explored = (E believed free + rim believed occupied) / E
- known = (E believed free or occupied) / E
- wrong = (E off the rim believed occupied + W known but with no occupied belief within one cell) / E
- wall recall = W with an occupied belief within one cell / W
- wall error = distance from each cell believed occupied to the nearest true wall cell: from the
  truth cell that holds the believed cell's centre, between cell centres
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.geometry import Pose2
from occmap.grid import Belief, GridFrame, OccupancyGrid
from sim.truth import Mask, TruthGrid, grown, rim, surface

BLOCK_CELLS = 1 << 16
"""A building may have millions of cells: so many are looked up at a time, for the memory that takes."""

SMALL_CELLS = 1 << 13
"""In a building less wide, cells counted from the start take 16 bits, however the map is turned."""


@dataclass(frozen=True)
class MapScore:
    """Ratios in [0, 1] and metres, as defined at the top of this file."""

    explored: float
    known: float
    wrong: float
    wall_recall: float
    wall_error_mean_m: float
    """nan while no cell is believed occupied."""
    wall_error_p95_m: float
    wrong_cells: int


class Scorer:
    """Scores any number of maps of one building, at the truth grid's resolution, against its truth.

    Everything that does not depend on the map is worked out once, so that a score costs a look-up
    per explorable cell.
    """

    def __init__(self, truth: TruthGrid, explorable: Mask, world_from_map: Pose2) -> None:
        self.truth = truth
        self.explorable = explorable
        self.world_from_map = world_from_map
        self._explorable_cells = int(explorable.sum())
        if not self._explorable_cells:
            raise ValueError(f"nothing can be explored from {world_from_map}: no free cell is in sight")
        self._rim = explorable & rim(truth.wall)
        self._surface = surface(truth.wall, explorable)
        self._is_read = grown(grown(explorable))
        self._lattice_cells = self._cells_read()
        self._cells_to_wall = np.asarray(ndimage.distance_transform_edt(~truth.wall), np.float32)

    @property
    def explorable_area_m2(self) -> float:
        """What there is to explore."""
        return self._explorable_cells * self.truth.resolution_m**2

    def belief(self, grid: OccupancyGrid) -> NDArray[np.uint8]:
        """(ny, nx) the map's belief at the centre of each truth cell in or near the explorable area."""
        ny, nx = grid.shape
        values = np.empty(self._lattice_cells.shape[1], np.uint8)
        for block in blocks(len(values)):
            ix, iy = self._lattice_cells[:, block].astype(np.int32) - np.array([grid.offset], np.int32).T
            inside = (ix >= 0) & (ix < nx) & (iy >= 0) & (iy < ny)
            values[block] = np.take(grid.state.ravel(), iy * nx + ix, mode="clip") * inside  # else unknown, 0
        belief = np.full(self.explorable.shape, Belief.UNKNOWN, np.uint8)
        belief[self._is_read] = values
        return belief

    def _cells_read(self) -> NDArray[np.signedinteger]:
        """(2, n) the map's cells (ix, iy), counted from its frame's origin, at the truth cells to be read."""
        map_from_world, r = self.world_from_map.inverse(), self.truth.resolution_m
        lattice, read_at = GridFrame(r, (0.0, 0.0)), np.flatnonzero(self._is_read)
        is_small = max(self.explorable.shape) < SMALL_CELLS
        out = np.empty((2, len(read_at)), np.int16 if is_small else np.int32)
        for block in blocks(len(read_at)):
            iy, ix = np.divmod(read_at[block], self.explorable.shape[1])
            centres = self.truth.world_from_cell(np.column_stack((ix, iy)))
            out[:, block] = lattice.cell_from_map(map_from_world.apply(centres)).T
        return out

    def unexplored(self, grid: OccupancyGrid) -> Mask:
        """Explorable cells that the map has not got: unknown, or taken for an obstacle off the rim."""
        belief = self.belief(grid)
        return self.explorable & (belief != Belief.FREE) & ~(self._rim & (belief == Belief.OCCUPIED))

    def score(self, grid: OccupancyGrid) -> MapScore:
        """All figures of one map."""
        belief = self.belief(grid)
        free, occupied = belief == Belief.FREE, belief == Belief.OCCUPIED
        near_occupied = grown(occupied)
        explored = count(self.explorable & (free | (self._rim & occupied)))
        known = count(self.explorable & (free | occupied))
        missed = self._surface & ~near_occupied
        wrong = count(self.explorable & ~self._rim & occupied) + count(missed & (free | occupied))
        to_see = count(self._surface)
        mean_m, p95_m = self._wall_error_m(grid)
        return MapScore(
            explored=explored / self._explorable_cells,
            known=known / self._explorable_cells,
            wrong=wrong / self._explorable_cells,
            wall_recall=1.0 - count(missed) / to_see if to_see else 1.0,
            wall_error_mean_m=mean_m,
            wall_error_p95_m=p95_m,
            wrong_cells=wrong,
        )

    def _wall_error_m(self, grid: OccupancyGrid) -> tuple[float, float]:
        """Mean and 95th percentile over the cells believed occupied."""
        iy, ix = np.divmod(np.flatnonzero(grid.state == Belief.OCCUPIED), grid.shape[1])
        if not len(ix):
            return math.nan, math.nan
        centres = self.world_from_map.apply(grid.frame.map_from_cell(np.column_stack((ix, iy))))
        cells = self.truth.cell_from_world(centres)
        ny, nx = self._cells_to_wall.shape
        nearest = np.clip(cells, 0, (nx - 1, ny - 1))
        beyond = np.hypot(*(cells - nearest).T)  # of a cell outside of the truth grid
        error_m = (self._cells_to_wall[nearest[:, 1], nearest[:, 0]] + beyond) * self.truth.resolution_m
        return float(error_m.mean()), float(np.percentile(error_m, 95))


def count(mask: Mask) -> int:
    """True cells."""
    return int(np.count_nonzero(mask))


def blocks(n: int) -> Iterator[slice]:
    """All of n cells, BLOCK_CELLS at a time."""
    for start in range(0, n, BLOCK_CELLS):
        yield slice(start, start + BLOCK_CELLS)
