"""Surfaces that the map has lost: where beams have ended, and more have grazed past."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.grid import SOLID_HITS, Belief

Places = tuple[NDArray[np.intp], NDArray[np.intp]]

BESIDE = np.array([0, 0, 1, -1]), np.array([1, -1, 0, 0])
AROUND = np.repeat((-1, 0, 1), 3), np.tile((-1, 0, 1), 3)
"""Steps in y and x to the 4 neighbours, and to a cell itself and its 8."""


def worn_cells(state: NDArray[np.uint8], hits: NDArray[np.uint8]) -> NDArray[np.int32]:
    """(n,) flat indices of the cells that hold a surface, though the belief is not that they are occupied.

    A wall enters many cells with an edge only: most beams fly through the rest of such a cell, and take
    away what those that end in it give. Others it shows to a scan or two, whose returns noise puts a cell
    too far. Free space ends at a surface or at an edge yet to be looked into. So a surface is in

    - free cells beside unknown ones, if beams have ended there again and again (SOLID_HITS);
    - unknown cells beside free ones that are left, if any beam has ended there or in one of the 8
      neighbours: in a free one it was a stray return.

    What was there and has gone, a door's leaf or a passer-by, has been looked through since: there is no
    unknown beside it. state and hits are (ny, nx), as a grid has them. O(cells), once.
    """
    free, unknown = state == Belief.FREE, state == Belief.UNKNOWN
    grazed = _within(free & (hits >= SOLID_HITS))
    ends = (unknown & (hits < SOLID_HITS))[_steps(grazed, BESIDE)].any(axis=1)
    grazed = grazed[0][ends], grazed[1][ends]
    free[grazed] = False
    edge = _within(unknown & _has_neighbour(free))
    struck = ((hits > 0) & ~free)[_steps(edge, AROUND)].any(axis=1)
    iy, ix = (np.concatenate((a, b[struck])) for a, b in zip(grazed, edge, strict=True))
    return np.sort(iy * state.shape[1] + ix).astype(np.int32)


def _has_neighbour(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells that have a 4-neighbour in the mask; the outermost are left out."""
    out = np.zeros(mask.shape, bool)
    out[1:-1, 1:-1] = mask[:-2, 1:-1] | mask[2:, 1:-1] | mask[1:-1, :-2] | mask[1:-1, 2:]
    return out


def _within(mask: NDArray[np.bool_]) -> Places:
    """(iy, ix) of the mask's cells but for the outermost, in which no beam ends."""
    iy, ix = np.nonzero(mask[1:-1, 1:-1])
    return iy + 1, ix + 1


def _steps(places: Places, steps: Places) -> Places:
    """(n, k) the cells at so many steps from n places."""
    return places[0][:, None] + steps[0], places[1][:, None] + steps[1]
