"""Surfaces that the map has lost: where beams have ended again and again, and more have grazed past."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.grid import SOLID_HITS, Belief

STEP_X, STEP_Y = np.array([1, -1, 0, 0]), np.array([0, 0, 1, -1])


def worn_cells(state: NDArray[np.uint8], hits: NDArray[np.uint8]) -> NDArray[np.int32]:
    """(n,) flat indices of the cells that hold a surface, though the belief is not that they are occupied.

    A wall enters many cells with an edge only: most beams fly through the rest of such a cell, and take
    away what those that end in it give. Among solid cells (SOLID_HITS), a surface is in

    - those that the map is undecided about, beside free space: the prior says nothing about them any more;
    - free ones beside the unknown: free space ends at a surface or at an edge yet to be looked into, and
      beams have ended here.

    What was there and has gone, a door's leaf or a passer-by, has been looked through since: there is no
    unknown beside it. state and hits are (ny, nx), as a grid has them. O(cells), once.
    """
    within = np.s_[1:-1, 1:-1]  # no beam ends in the outermost cells
    iy, ix = np.nonzero((hits[within] >= SOLID_HITS) & (state[within] != Belief.OCCUPIED))
    iy, ix = iy + 1, ix + 1
    around = iy[:, None] + STEP_Y, ix[:, None] + STEP_X  # (n, 4) neighbours
    is_by_free = (state[around] == Belief.FREE).any(axis=1)
    is_by_unknown = ((state[around] == Belief.UNKNOWN) & (hits[around] < SOLID_HITS)).any(axis=1)
    is_surface = np.where(state[iy, ix] == Belief.FREE, is_by_unknown, is_by_free)
    return (iy * state.shape[1] + ix)[is_surface].astype(np.int32)
