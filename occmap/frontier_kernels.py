"""Kernels: which cells are frontier, and which of them belong together.

The cost follows the number of changed cells and of frontier cells, never the size of the map.
"""

from __future__ import annotations

import numpy as np

from occmap.grid import FREE, OCCUPIED, SOLID_HITS, UNKNOWN
from occmap.kernel import kernel, part

FRONTIER = np.uint8(1)
"""A frontier cell in the mask. While cells are clustered, the mask also holds the marks below."""
NOTED = np.uint8(128)
"""Added to the mask of a cell that is about to be looked at."""
NONE, ONE, TWO = np.int64(0), np.int64(1), np.int64(2)
"""Typed: literals would have `flood` compiled once more for each."""
REACH, STRUCK_REACH = 2, 3
"""So many cells away, along both axes, a change of state, or the first hits of a cell, show in the mask."""
SQUARE, STRUCK_SQUARE = (2 * REACH + 1) ** 2, (2 * STRUCK_REACH + 1) ** 2
"""Cells within that."""
FLOODED, ECHOED, ONE_HALF, OTHER_HALF, DONE = np.uint8(2), np.uint8(3), np.uint8(4), np.uint8(5), np.uint8(6)


@kernel
def is_struck(hits, iy, ix, ignore_struck):
    """Whether beams have told of a surface here, whatever grazes it: many ended here, or beside it, too.

    A stray return has no neighbours; SOLID_HITS of them in one cell are no strays, and count in any case.
    """
    if hits[iy, ix] >= SOLID_HITS:
        return True
    if hits[iy, ix] == 0 or not ignore_struck:
        return False
    ny, nx = hits.shape
    others = -1
    for y in range(max(iy - 1, 0), min(iy + 2, ny)):
        for x in range(max(ix - 1, 0), min(ix + 2, nx)):
            others += hits[y, x] > 0
    return others >= 2


@part
def beside_surface(state, hits, iy, ix, ignore_struck):
    """Whether a cell has an 8-neighbour that is occupied or struck.

    Few cells have been hit: that is asked first, and saves a quarter of all that `update_mask` costs.
    """
    ny, nx = state.shape
    for y in range(max(iy - 1, 0), min(iy + 2, ny)):
        for x in range(max(ix - 1, 0), min(ix + 2, nx)):
            if state[y, x] == OCCUPIED or (hits[y, x] and is_struck(hits, y, x, ignore_struck)):
                return True
    return False


@part
def is_between_beams(state, iy, ix):
    """Whether an unknown cell is a speck or in a line one cell wide, such as beams leave out between them:
    at most two of its 8-neighbours are unknown. The outside of the array is unknown.
    """
    ny, nx = state.shape
    unknown = 0
    for y in range(iy - 1, iy + 2):
        for x in range(ix - 1, ix + 2):
            is_known = 0 <= y < ny and 0 <= x < nx and state[y, x] != UNKNOWN
            unknown += not is_known
    return unknown <= 3  # the cell itself is one


@kernel
def is_frontier(state, hits, iy, ix, ignore_rim, ignore_struck):
    """A free cell with an unknown 4-neighbour; the outside of the array is unknown (Yamauchi 1997).

    Cells that beams have struck count as neither, whatever the belief of the moment: those with SOLID_HITS,
    or, with ignore_struck, with any. With ignore_rim, nor do unknown cells beside an occupied or struck
    one, and those that beams merely left out between them.
    """
    if state[iy, ix] != FREE:
        return False
    ny, nx = state.shape
    for dy, dx in ((-1, 0), (0, -1), (0, 1), (1, 0)):
        y, x = iy + dy, ix + dx
        inside = 0 <= y < ny and 0 <= x < nx
        if inside and (state[y, x] != UNKNOWN or is_struck(hits, y, x, ignore_struck)):
            continue
        if ignore_rim and (is_between_beams(state, y, x) or beside_surface(state, hits, y, x, ignore_struck)):
            continue
        return not is_struck(hits, iy, ix, ignore_struck)
    return False


@kernel
def update_mask(flat_cells, struck, state, hits, mask, ignore_rim, ignore_struck):
    """Mend the mask around cells (n,) that changed; returns the flat indices of cells that became frontier
    cells or ceased to be.

    A cell depends on its 4-neighbours and on their 8-neighbours: what is within two cells of a change is
    looked at once. Where a beam has struck (m,), so do the cells next to it, and frontier cells can only
    cease to be. O(25 n + 49 m).
    """
    ny, nx = state.shape
    stirred = np.empty(SQUARE * flat_cells.shape[0] + STRUCK_SQUARE * struck.shape[0], np.int32)
    n_around, n = 0, 0
    for k in range(flat_cells.shape[0]):
        cy, cx = flat_cells[k] // nx, flat_cells[k] % nx
        for iy in range(max(cy - REACH, 0), min(cy + REACH + 1, ny)):
            for ix in range(max(cx - REACH, 0), min(cx + REACH + 1, nx)):
                if mask[iy, ix] < NOTED:
                    mask[iy, ix] += NOTED
                    stirred[n_around] = iy * nx + ix
                    n_around += 1
    for k in range(struck.shape[0]):
        cy, cx = struck[k] // nx, struck[k] % nx
        for iy in range(max(cy - STRUCK_REACH, 0), min(cy + STRUCK_REACH + 1, ny)):
            for ix in range(max(cx - STRUCK_REACH, 0), min(cx + STRUCK_REACH + 1, nx)):
                if mask[iy, ix] == FRONTIER:
                    mask[iy, ix] += NOTED
                    stirred[n_around] = iy * nx + ix
                    n_around += 1
    for k in range(n_around):
        iy, ix = stirred[k] // nx, stirred[k] % nx
        now = np.uint8(is_frontier(state, hits, iy, ix, ignore_rim, ignore_struck))
        was, mask[iy, ix] = mask[iy, ix] - NOTED, now
        if now != was:
            stirred[n] = stirred[k]
            n += 1
    return stirred[:n].copy()


@kernel
def flood(mask, first, last, queue, old, new):
    """Flood breadth first from cells queue[first:last] (already marked) through 8-neighbours marked `old`.

    Each takes the mark of the cell that reached it if `new` is 0, else `new`. Returns the end of the
    queue, whose last cell is one of the farthest. O(cells reached).
    """
    ny, nx = mask.shape
    while first < last:
        cy, cx = queue[first] // nx, queue[first] % nx
        mark = new if new else mask[cy, cx]
        first += 1
        for iy in range(max(cy - 1, 0), min(cy + 2, ny)):
            for ix in range(max(cx - 1, 0), min(cx + 2, nx)):
                if mask[iy, ix] == old:
                    mask[iy, ix] = mark
                    queue[last] = iy * nx + ix
                    last += 1
    return last


@kernel
def loosen(mask, grouped, stirred, room):
    """Undo the groups that cells (n,) touch which became frontier or ceased to be; all others still hold.

    grouped (ny, nx) is 1 in cells that are in a group. Returns how many flat indices are in room: the
    frontier cells, some perhaps twice, that are in none now, and cells that were frontier. O(cells loosened).
    """
    ny, nx = mask.shape
    last = 0
    for cell in stirred:
        cy, cx = cell // nx, cell % nx
        if mask[cy, cx]:
            room[last] = cell
            last += 1
        first = last
        for iy in range(max(cy - 1, 0), min(cy + 2, ny)):
            for ix in range(max(cx - 1, 0), min(cx + 2, nx)):
                if grouped[iy, ix]:
                    grouped[iy, ix] = 0
                    room[last] = iy * nx + ix
                    last += 1
        last = flood(grouped, first, last, room, FRONTIER, np.uint8(0))
    return last


@part
def extent(cells, nx):
    """The longer side of the box around flat cells, in cells."""
    x0, x1, y0, y1 = nx, 0, np.int64(2**62), np.int64(0)
    for k in range(cells.shape[0]):
        y, x = cells[k] // nx, cells[k] % nx
        x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return max(x1 - x0, y1 - y0) + 1


@kernel
def paint(flat, cells, mark):
    """Give all cells a mark. O(cells)."""
    for k in range(cells.shape[0]):
        flat[cells[k]] = mark


@part
def halve(mask, flat, cells, room):
    """Cut a connected set of FLOODED cells in two between its far ends; reorders cells, marks them DONE.

    Each half holds the cells nearer to its end along the set, so each is connected. Returns where
    the second half begins. O(cells).
    """
    n = cells.shape[0]
    room[0] = cells[0]
    flat[room[0]] = ECHOED
    end = room[flood(mask, NONE, ONE, room, FLOODED, ECHOED) - 1]
    room[0] = end
    flat[end] = FLOODED
    other_end = room[flood(mask, NONE, ONE, room, ECHOED, FLOODED) - 1]
    room[0], room[1] = end, other_end
    flat[end], flat[other_end] = ONE_HALF, OTHER_HALF
    flood(mask, NONE, TWO, room, FLOODED, np.uint8(0))
    low, high = 0, n
    for k in range(n):
        if flat[room[k]] == ONE_HALF:
            cells[low] = room[k]
            low += 1
        else:
            high -= 1
            cells[high] = room[k]
    paint(flat, cells, DONE)
    return low


@kernel
def cluster(mask, flat, listed, max_extent):
    """Group the frontier cells by 8-connectivity and halve groups longer than max_extent cells.

    flat is the mask seen flat; listed (n,) flat indices holds every frontier cell, perhaps twice, and
    perhaps cells that are none any more. Returns the cells (m, 2) group by group, the ends (g,) of the
    groups, and their centroids (g, 2) in cells. O(n), times log(length / max_extent) for what is halved.
    """
    nx, n = mask.shape[1], listed.shape[0]
    order, room = np.empty(n, np.int32), np.empty(n, np.int32)
    ends, cuts = np.empty(n, np.int64), np.empty(n + 1, np.int64)
    groups, start = NONE, NONE
    for seed in listed:
        if flat[seed] != FRONTIER:
            continue
        order[start], flat[seed] = seed, FLOODED
        cuts[0], waiting = flood(mask, start, start + 1, order, FRONTIER, FLOODED), 1
        while waiting:  # the piece at hand is order[start : the nearest cut]
            piece = order[start : cuts[waiting - 1]]
            if extent(piece, nx) > max_extent:
                paint(flat, piece, FLOODED)
                cuts[waiting] = start + halve(mask, flat, piece, room)
                waiting += 1
            else:
                paint(flat, piece, DONE)
                waiting -= 1
                ends[groups] = start = cuts[waiting]
                groups += 1
    return summarise(flat, order[:start], ends[:groups], nx)


@part
def summarise(flat, order, ends, nx):
    """Cells as (ix, iy) and centroids of groups; leaves the mask with FRONTIER alone. O(cells)."""
    cells = np.empty((order.shape[0], 2), np.int64)
    centroids = np.empty((ends.shape[0], 2))
    start = 0
    for group in range(ends.shape[0]):
        centroids[group, 0] = centroids[group, 1] = 0.0
        for k in range(start, ends[group]):
            flat[order[k]] = FRONTIER
            cells[k, 0], cells[k, 1] = order[k] % nx, order[k] // nx
            centroids[group, 0] += cells[k, 0]
            centroids[group, 1] += cells[k, 1]
        centroids[group, 0] /= ends[group] - start
        centroids[group, 1] /= ends[group] - start
        start = ends[group]
    return cells, ends.copy(), centroids
