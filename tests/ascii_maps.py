"""Small maps drawn as text, for tests.

The lowest line of the picture is row 0, as in the grid: what is drawn above lies at higher y.
`#` is occupied, `.` free, `?` unknown.
"""

from __future__ import annotations

from textwrap import dedent

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Belief, GridConfig, OccupancyGrid

STATES = {"?": Belief.UNKNOWN, ".": Belief.FREE, "#": Belief.OCCUPIED}


def ascii_map(text: str) -> NDArray[np.str_]:
    """(ny, nx) characters, row 0 = the LOWEST line."""
    lines = [line.strip() for line in dedent(text).strip().splitlines()]
    if len({len(line) for line in lines}) != 1:
        raise ValueError(f"all lines of a map must be of one length, got {[len(line) for line in lines]}")
    return np.array([list(line) for line in reversed(lines)])


def ascii_state(text: str) -> NDArray[np.uint8]:
    """(ny, nx) uint8 states, as in OccupancyGrid.state."""
    drawn = ascii_map(text)
    strange = sorted(set(drawn.ravel().tolist()) - set(STATES))
    if strange:
        raise ValueError(f"a map is drawn with {' '.join(STATES)}, got {' '.join(strange)}")
    return np.vectorize(STATES.__getitem__, otypes=[np.uint8])(drawn)


def ascii_grid(text: str, resolution_m: float = 0.05) -> OccupancyGrid:
    """A grid that believes what is drawn; its cell (0, 0) has its corner at (0, 0) of the map frame."""
    return grid_of(ascii_state(text), resolution_m)


def grid_of(state: NDArray[np.uint8], resolution_m: float = 0.05) -> OccupancyGrid:
    """A grid that believes these states, each with certainty."""
    grid = OccupancyGrid(GridConfig(resolution_m=resolution_m))
    ny, nx = state.shape
    grid.grow_to_contain((0.0, 0.0), ((nx - 0.5) * resolution_m, (ny - 0.5) * resolution_m))
    certainly = grid.config.clamp
    grid.state[:] = state
    grid.log_odds[:] = np.select(
        [state == Belief.FREE, state == Belief.OCCUPIED], [-certainly, certainly], 0.0
    )
    return grid


def cells(mask: NDArray) -> set[tuple[int, int]]:
    """The set cells (ix, iy) of a mask."""
    iy, ix = np.nonzero(mask)
    return set(zip(ix.tolist(), iy.tolist(), strict=True))
