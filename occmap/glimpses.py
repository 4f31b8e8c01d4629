"""Glimpses: what some beams went through, though too few to call it free, and no free cell leads up to."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.goal_config import SPECK_M
from occmap.grid import Belief, OccupancyGrid
from occmap.slices import Sliced

GLIMPSED = 0.1
"""In log-odds: a cell that is likelier to be free than the prior by more was seen through at least once."""
TWICE = 0.5
"""Share of the way from the prior to free that some cell of a place must have come. What one beam alone went
through may be a lost echo, which lays a line through walls and out of the building."""
MOST_M = 1.0
"""No piece is longer."""
AROUND = np.ones((3, 3), bool)


def glimpses(grid: OccupancyGrid) -> Sliced[list[tuple[tuple[float, float], float]]]:
    """The middle in `map` and the length, metres, of each place longer than SPECK_M that was only glimpsed,
    piece by piece where it is long.

    Through a window or a crack a beam or two reach far, and never the same cells from two places: what is
    there stays undecided, and no frontier tells of it, for it has no free cell. O(cells), for the end.
    A place none of whose cells was seen through twice is left out.
    """
    undecided = (grid.state == Belief.UNKNOWN) & (grid.log_odds < grid.prior_log_odds - GLIMPSED)
    parts, n = _parts(undecided)
    yield grid.state.size
    has_frontier = np.zeros(n + 1, bool)
    has_frontier[parts[_beside_free(undecided, grid)]] = True
    found, r = [], grid.frame.resolution_m
    seen_twice = grid.prior_log_odds + TWICE * (grid.free_below - grid.prior_log_odds)
    yield grid.state.size
    for part, box in enumerate(ndimage.find_objects(parts), start=1):
        if box is None or has_frontier[part]:
            continue
        height, width = (side.stop - side.start for side in box)
        if max(height, width) * r <= SPECK_M:
            continue
        of_part = parts[box] == part
        if grid.log_odds[box][of_part].min() > seen_twice:
            continue
        cells = np.argwhere(of_part) + np.array([side.start for side in box])
        cells = cells[np.argsort(cells[:, int(width > height)], kind="stable"), ::-1]
        for piece in np.array_split(cells, math.ceil(max(height, width) * r / MOST_M)):
            x_m, y_m = grid.frame.map_from_cell(piece.mean(axis=0, keepdims=True))[0]
            size_m = float(np.hypot(*(np.ptp(piece, axis=0) + 1))) * r
            found.append(((float(x_m), float(y_m)), size_m))
    return found


def _beside_free(mask: NDArray[np.bool_], grid: OccupancyGrid) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(iy, ix) of the cells of a mask that have a free one among their 8 neighbours."""
    iy, ix = np.nonzero(mask)
    state, is_beside = np.pad(grid.state, 1), np.zeros(len(ix), bool)
    for dy, dx in np.ndindex(AROUND.shape):
        is_beside |= state[iy + dy, ix + dx] == Belief.FREE
    return iy[is_beside], ix[is_beside]


def _parts(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int32], int]:
    """(ny, nx) the number of each cell's 8-connected part, counted from 1, and how many there are."""
    labels: Any = ndimage.label(mask, AROUND)
    return np.asarray(labels[0], np.int32), int(labels[1])
