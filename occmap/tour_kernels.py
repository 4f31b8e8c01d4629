"""Kernels of the tour: a coarse look at the map, and the shortest way through a few places."""

from __future__ import annotations

import math

import numpy as np

from occmap.goals_kernels import INSIDE_X, INSIDE_Y, sees, sees_into
from occmap.grid import FREE, OCCUPIED
from occmap.kernel import kernel, part

MOST_LINES = 12
"""So many blocks are asked whether they see a frontier; the next would be far off."""
FIRST_PAIRS = 256
"""Room for so many pairs at first; twice as much whenever they run out."""


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
        best, where = 2 * (reach + 1) * (reach + 1), -1
        for jy in range(max(0, by - ring), min(ny, by + ring + 1)):
            is_edge = abs(jy - by) == ring
            for jx in range(max(0, bx - ring), min(nx, bx + ring + 1)):
                if not (is_edge or abs(jx - bx) == ring) or coarse_state[jy, jx] != FREE:
                    continue
                away = (jx - bx) * (jx - bx) + (jy - by) * (jy - by)
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
def watchers(state, clearance_m, side, cost_m, targets, ends, reach, share):
    """Which blocks see into which frontiers: pairs (n, 2) of a block's flat index and a frontier's.

    cost_m (ny, nx) is to blocks, inf where nobody gets; targets (m, 5), as for `sees_into`, are the
    frontiers' in turn, up to ends (k,); reach (k,) in cells. A block sees a frontier if at least `share` of
    its targets are in line of sight from the block's roomiest cell. O(frontiers x blocks in reach) lines.
    """
    ny, nx = cost_m.shape
    pairs = np.empty((FIRST_PAIRS, 2), np.int64)
    n = 0
    roomiest = np.empty((ny, nx), np.int64)
    roomiest[:, :] = -1
    first = 0
    for k in range(ends.shape[0]):
        mine = targets[first : ends[k]]
        first = ends[k]
        needed = max(1, math.ceil(share * mine.shape[0]))
        x_low, x_high, y_low, y_high = nx * side, 0, ny * side, 0
        for x, y in mine[:, :2]:
            x_low, x_high, y_low, y_high = min(x_low, x), max(x_high, x), min(y_low, y), max(y_high, y)
        for by in range(max(0, (y_low - reach[k]) // side), min(ny, (y_high + reach[k]) // side + 1)):
            for bx in range(max(0, (x_low - reach[k]) // side), min(nx, (x_high + reach[k]) // side + 1)):
                if not cost_m[by, bx] < np.inf:
                    continue
                if roomiest[by, bx] < 0:
                    roomiest[by, bx] = roomiest_cell(state, clearance_m, side, bx, by)
                y, x = divmod(roomiest[by, bx], state.shape[1])
                seen = 0
                for j in range(mine.shape[0]):
                    if seen >= needed or seen + mine.shape[0] - j < needed:
                        break
                    away_x, away_y = mine[j, INSIDE_X] - x, mine[j, INSIDE_Y] - y
                    near = away_x * away_x + away_y * away_y <= reach[k] * reach[k]
                    seen += near and sees_into(state, x, y, mine, j)
                if seen >= needed:
                    if n == pairs.shape[0]:
                        fewer, pairs = pairs, np.empty((2 * n, 2), np.int64)
                        for j in range(n):
                            pairs[j, 0], pairs[j, 1] = fewer[j, 0], fewer[j, 1]
                    pairs[n, 0], pairs[n, 1] = by * nx + bx, k
                    n += 1
    return pairs[:n]


@part
def roomiest_cell(state, clearance_m, side, bx, by):
    """The flat index of the free cell of a block with the largest clearance; its corner if it has none."""
    ny, nx = state.shape
    best, widest = by * side * nx + bx * side, np.float32(-1.0)
    for y in range(by * side, min(by * side + side, ny)):
        for x in range(bx * side, min(bx * side + side, nx)):
            if state[y, x] == FREE and clearance_m[y, x] > widest:
                best, widest = y * nx + x, clearance_m[y, x]
    return best


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
