"""The occupancy grid: where cells are (GridFrame) and what they hold (OccupancyGrid)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points
from occmap.lazy_arrays import copy_written, filled

Cells = NDArray[np.int64]
"""(n, 2) cell indices (ix, iy) = (column, row)."""

BORDER = 1e-9
"""In cells: a point this close below a cell's border counts as on it. Without it, rounding decides in
which cell the robot's start (0, 0) lies, differently before and after the grid has grown."""
SOLID_HITS = 4
"""A cell in which so many beams ended holds a surface, whatever flew through the rest of it since. Beams that
graze a wall take the belief of the cells that it only enters away again, far more often than they are hit."""
MOST_HITS = 255
"""Beams that ended in a cell are counted in a byte, and no farther."""
MOST_SLACK_M = 25.0
"""Beyond what it must, a grid grows by no more than this on a side."""


class Belief(IntEnum):
    """What a cell is taken for: the values of OccupancyGrid.state."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


UNKNOWN, FREE, OCCUPIED = np.uint8(Belief.UNKNOWN), np.uint8(Belief.FREE), np.uint8(Belief.OCCUPIED)
"""The same for kernels, in the arrays' own type."""


@dataclass(frozen=True, slots=True)
class GridFrame:
    """The one door between metres and cells: cell (0, 0) has its lower-left corner at origin_m."""

    resolution_m: float
    origin_m: tuple[float, float]

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise ValueError(f"resolution_m must be positive, got {self.resolution_m}")

    def in_cells(self, points: Points) -> Points:
        """(n, 2) metres -> (n, 2) the same places in units of cells, from the corner of cell (0, 0)."""
        return (points - np.asarray(self.origin_m)) / self.resolution_m + BORDER

    def cell_from_map(self, points: Points) -> Cells:
        """(n, 2) metres -> (n, 2) cells (ix, iy). Floors, also left of the origin."""
        return np.floor(self.in_cells(points)).astype(np.int64)

    def map_from_cell(self, cells: Cells | Points) -> Points:
        """(n, 2) cells (ix, iy), also between cells -> (n, 2) metres, the cells' centres."""
        return (np.asarray(cells, np.float64) + 0.5) * self.resolution_m + np.asarray(self.origin_m)

    def cell_at(self, x_m: float, y_m: float) -> tuple[int, int]:
        """The cell (ix, iy) that holds one point."""
        return (
            math.floor((x_m - self.origin_m[0]) / self.resolution_m + BORDER),
            math.floor((y_m - self.origin_m[1]) / self.resolution_m + BORDER),
        )

    def centre_of(self, ix: int, iy: int) -> tuple[float, float]:
        """The centre of one cell, in metres."""
        return (
            (ix + 0.5) * self.resolution_m + self.origin_m[0],
            (iy + 0.5) * self.resolution_m + self.origin_m[1],
        )


def log_odds(probability: float) -> float:
    """log(p / (1 - p)) of a probability between 0 and 1, both excluded."""
    return math.log(probability / (1.0 - probability))


@dataclass(frozen=True)
class GridConfig:
    """What a cell's belief means."""

    resolution_m: float = 0.05
    """Side of a cell."""
    prior: float = 0.5
    """Probability of being occupied before anything is seen."""
    free_below: float = 0.3
    """A cell less likely than this to be occupied is free."""
    occupied_above: float = 0.7
    """A cell more likely than this to be occupied is an obstacle."""
    clamp: float = 6.0
    """Log-odds stay within +-clamp, so that a world that changed can be learned anew."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise ValueError(f"resolution_m must be positive, got {self.resolution_m}")
        if not 0.0 < self.prior < 1.0:
            raise ValueError(f"prior must lie between 0 and 1, got {self.prior}")
        if not 0.0 < self.free_below < self.occupied_above < 1.0:
            raise ValueError(
                f"need 0 < free_below < occupied_above < 1, got {self.free_below} and {self.occupied_above}"
            )
        if not self.free_below <= self.prior <= self.occupied_above:
            raise ValueError(
                f"a cell never seen must be unknown, but prior {self.prior} is outside the thresholds"
            )
        if not self.clamp > max(log_odds(self.occupied_above), -log_odds(self.free_below)):
            raise ValueError(
                f"clamp {self.clamp} keeps every cell within the thresholds: nothing is ever known"
            )


class OccupancyGrid:
    """Log-odds of being occupied, cell by cell, over a rectangle that grows as the robot needs it.

    Moravec and Elfes, High resolution maps from wide angle sonar, ICRA 1985; in log-odds: Thrun, Burgard
    and Fox, Probabilistic Robotics, 2005, section 9.2.

    `log_odds` and `state` are (ny, nx) arrays `a[iy, ix]`, row 0 at the lowest y. `state` is the
    thresholded belief (see Belief); whoever writes log_odds keeps state in step (Mapper does).
    `hits` counts the beams that ended in each cell, up to MOST_HITS.
    The lattice is fixed to the map frame: a cell's centre never moves when the grid grows, only
    the index of the array's first cell, `offset`, does.
    """

    def __init__(self, config: GridConfig | None = None) -> None:
        self.config = config or GridConfig()
        self.prior_log_odds = np.float32(log_odds(self.config.prior))
        self.free_below = np.float32(log_odds(self.config.free_below))
        self.occupied_above = np.float32(log_odds(self.config.occupied_above))
        self.offset = (0, 0)  # lattice index (ix, iy) of array cell (0, 0)
        self.log_odds: NDArray[np.float32] = np.empty((0, 0), np.float32)
        self.state: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self.hits: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self._set_frame()

    def _set_frame(self) -> None:
        r = self.config.resolution_m
        self._frame = GridFrame(r, (self.offset[0] * r, self.offset[1] * r))

    @property
    def frame(self) -> GridFrame:
        """Changes when the grid grows: keep metres, not cells, across scans."""
        return self._frame

    @property
    def shape(self) -> tuple[int, int]:
        """(ny, nx)"""
        return self.log_odds.shape

    def contains(self, ix: int, iy: int) -> bool:
        """Whether there is such a cell."""
        return 0 <= ix < self.shape[1] and 0 <= iy < self.shape[0]

    def probability(self) -> NDArray[np.float32]:
        """(ny, nx) P(occupied)."""
        return (1.0 / (1.0 + np.exp(-self.log_odds))).astype(np.float32, copy=False)

    def grow_to_contain(self, low_m: tuple[float, float], high_m: tuple[float, float]) -> bool:
        """Make room for the box from low_m (x, y) to high_m, both within, in the map frame.

        True if the arrays are others than before: cells have other indices then, views of them are void.

        Each side that must move goes out by half of the grid's extent, at most MOST_SLACK_M, or as far as the
        box requires if that is more: copying is amortised, and a large map is not mostly empty.
        """
        ny, nx = self.shape
        r = self.config.resolution_m
        low = [math.floor(v / r + BORDER) for v in low_m]
        high = [math.floor(v / r + BORDER) + 1 for v in high_m]
        if nx == 0:
            new_low, new_high = low, high
        else:
            old_low, old_high = self.offset, (self.offset[0] + nx, self.offset[1] + ny)
            if all(low[k] >= old_low[k] and high[k] <= old_high[k] for k in (0, 1)):
                return False
            most = round(MOST_SLACK_M / r)
            slack = (min(nx // 2, most), min(ny // 2, most))
            new_low = [
                old_low[k] if low[k] >= old_low[k] else min(low[k], old_low[k] - slack[k]) for k in (0, 1)
            ]
            new_high = [
                old_high[k] if high[k] <= old_high[k] else max(high[k], old_high[k] + slack[k])
                for k in (0, 1)
            ]
        shape = (new_high[1] - new_low[1], new_high[0] - new_low[0])
        offset = (new_low[0], new_low[1])
        self.log_odds = moved(self.log_odds, self.offset, offset, shape, self.prior_log_odds)
        self.state = moved(self.state, self.offset, offset, shape, np.uint8(Belief.UNKNOWN))
        self.hits = moved(self.hits, self.offset, offset, shape, np.uint8(0))
        self.offset = offset
        self._set_frame()
        return True


def flat_inside(cells: Cells, shape: tuple[int, int]) -> NDArray[np.int64]:
    """(k,) ascending flat indices of those cells (n, 2) that lie in arrays of a shape (ny, nx), each once."""
    (ny, nx), (ix, iy) = shape, cells.T
    inside = (ix >= 0) & (iy >= 0) & (ix < nx) & (iy < ny)
    return np.unique(iy[inside] * nx + ix[inside])


def moved(
    array: NDArray,
    old_offset: tuple[int, int],
    new_offset: tuple[int, int],
    shape: tuple[int, int],
    fill: np.generic,
) -> NDArray:
    """(ny, nx) copy of a layer in an array of a larger shape that holds it; new cells hold fill.

    Offsets (ix, iy) are lattice indices of the arrays' first cells, as OccupancyGrid.offset.
    """
    out = filled(shape, fill, array.dtype)
    ny, nx = array.shape
    if array.size:
        dx, dy = old_offset[0] - new_offset[0], old_offset[1] - new_offset[1]
        copy_written(array, out[dy : dy + ny, dx : dx + nx], is_blank=fill == 0)
    return out
