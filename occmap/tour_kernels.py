"""Kernels of the tour: a coarse look at the map, and the shortest way through a few places."""

from __future__ import annotations

import numpy as np

from occmap.goals_kernels import sees
from occmap.grid import Belief
from occmap.kernel import kernel

FREE, OCCUPIED = np.uint8(Belief.FREE), np.uint8(Belief.OCCUPIED)
MOST_LINES = 12
"""So many blocks are asked whether they see a frontier; the next would be far off."""


@kernel
def coarsen(state, clearance_m, side, least_m, coarse_state, coarse_clearance_m):
    """Fill a map of blocks of side x side cells: free where the body has room in any cell of a block.

    The clearance of a block is the largest in it. O(cells), row by row, which the compiler vectorises.
    """
    ny, nx = state.shape
    widest = np.empty(nx, np.float32)
    for by in range(coarse_state.shape[0]):
        widest[:] = np.float32(0.0)
        for iy in range(by * side, min(by * side + side, ny)):
            states, clearances_m = state[iy], clearance_m[iy]
            for ix in range(nx):
                clear = clearances_m[ix] if states[ix] == FREE else np.float32(0.0)
                widest[ix] = clear if clear > widest[ix] else widest[ix]
        for bx in range(coarse_state.shape[1]):
            clear = np.float32(0.0)
            for ix in range(bx * side, min(bx * side + side, nx)):
                clear = max(clear, widest[ix])
            has_room = clear >= least_m
            coarse_state[by, bx] = FREE if has_room else OCCUPIED
            coarse_clearance_m[by, bx] = clear if has_room else np.float32(0.0)


@kernel
def nearest_block(state, coarse_state, side, x, y, reach, most_unknown):
    """The flat index of the free block nearest to cell (x, y) and in sight of it; -1 if none is within reach.

    reach is in blocks; most_unknown as in `sees`. O(reach**2) and a few lines.
    """
    ny, nx = coarse_state.shape
    bx, by = x // side, y // side
    seen_from = 0
    for ring in range(reach + 1):
        best, where = 2 * (reach + 1) ** 2, -1
        for jy in range(max(0, by - ring), min(ny, by + ring + 1)):
            is_edge = abs(jy - by) == ring
            for jx in range(max(0, bx - ring), min(nx, bx + ring + 1)):
                if not (is_edge or abs(jx - bx) == ring) or coarse_state[jy, jx] != FREE:
                    continue
                away = (jx - bx) ** 2 + (jy - by) ** 2
                if away >= best:
                    continue
                seen_from += 1
                to_x = min(jx * side + side // 2, state.shape[1] - 1)
                to_y = min(jy * side + side // 2, state.shape[0] - 1)
                if sees(state, x, y, to_x, to_y, most_unknown):
                    best, where = away, jy * nx + jx
        if where >= 0 or seen_from >= MOST_LINES:
            return where
    return -1


@kernel
def best_after(between, at_the_end):
    """(2**n, n): the least cost of visiting every place of a set, beginning at one of them, ending anywhere.

    between (n, n): costs from place to place; at_the_end (n,): what ending there costs. Held and Karp,
    A dynamic programming approach to sequencing problems, 1962, from the end. O(2**n n**2).
    """
    n = between.shape[0]
    best = np.empty((1 << n, n))
    for places in range(1 << n):
        for here in range(n):
            rest = places & ~(1 << here)
            best[places, here] = np.inf
            if rest == places:
                continue
            least = at_the_end[here] if rest == 0 else np.inf
            for after in range(n):
                if rest & (1 << after):
                    least = min(least, between[here, after] + best[rest, after])
            best[places, here] = least
    return best
