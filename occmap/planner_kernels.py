"""The search behind every path: one bucket queue that floods, or heads for a box of cells.

Cells are flat indices iy * nx + ix. Costs are integers: STRAIGHT for one step to a 4-neighbour of
weight one, so that sums are exact and the order of additions does not matter. What entering a cell
costs is looked up from its belief and clearance in `entry_cost`, (3 * bins,): a row for each Belief,
BINS_PER_M columns for each metre of clearance, 0 where the body does not go.
"""

import math

import numpy as np

from occmap.grid import OCCUPIED
from occmap.kernel import kernel, part

STRAIGHT_BITS = 10
STRAIGHT = 1 << STRAIGHT_BITS
DIAGONAL = 1448  # 1024 * sqrt(2), rounded down: 0.01 % short
BINS_PER_M = 200
UNREACHED = 2**31 - 1
DIRECTION, OPEN, TARGET = 7, 8, 16
"""Bits of a cell's link: the direction that the cheapest way came by, whether the cell waits, is a target."""
ALL_BITS = 255
AT_BUCKET, N_WAITING, N_SETTLED, N_TOUCHED = 0, 1, 2, 3
"""Places in `at`, how far a search is: the bucket, cells waiting, targets settled, cells touched."""
NOT_BEGUN = -1
"""Of cells waiting: the next call begins a search."""
OUT_OF_MEMORY = -1
CELL, NEXT = 0, 1
"""Of an entry of the queue: what it holds, and the next one of its list."""
VACATED, N_USED = -2, -1
"""Places in `heads` after those of the buckets: the list of vacated entries, the number ever used."""
NO_ENTRY = -1
"""Ends a list."""
ROUNDING = 0.02
"""Of a bin: float32 metres that lie on a bin's border are taken for it and not for the one below."""
TOLERANCE = 1.01
"""A shortcut may cost so many times what it replaces: what the line costs is an estimate, from samples,"""
SAMPLING_ERROR = 0.25 * STRAIGHT
"""and so much more: a quarter of the cheapest step."""
PATIENCE = 6
"""So many failures in a row end the look for a shortcut."""
STEP_X = (1, 0, -1, 0, 1, -1, -1, 1)  # the straight ones first: a diagonal lies between two of them
STEP_Y = (0, 1, 0, -1, 1, 1, -1, -1)


@part
def price(cell, state, clearance_m, entry_cost, bins):
    """Cost of entering a cell, 0 if the body does not go there."""
    column = min(int(clearance_m[cell] * BINS_PER_M + ROUNDING), bins - 1)
    return entry_cost[state[cell] * bins + column]


@part
def octile(ix, iy, box):
    """The least cost from a cell to the box (ix0, iy0, ix1, iy1), both ends within."""
    dx = max(box[0] - ix, 0, ix - box[2])
    dy = max(box[1] - iy, 0, iy - box[3])
    return STRAIGHT * max(dx, dy) + (DIAGONAL - STRAIGHT) * min(dx, dy)


@kernel
def _push(cell, slot, heads, items):
    """Put a cell into a bucket; whether there was room.

    heads: the first entry of each bucket's list, and at the end VACATED and N_USED.
    """
    entry = heads[VACATED]
    if entry != NO_ENTRY:
        heads[VACATED] = items[entry, NEXT]
    else:
        entry = heads[N_USED]
        if entry >= len(items):
            return False
        heads[N_USED] += 1
    items[entry, CELL], items[entry, NEXT] = cell, heads[slot]
    heads[slot] = entry
    return True


@part
def _pop(slot, heads, items):
    """Take the cell last put into a bucket that is not empty."""
    entry = heads[slot]
    heads[slot] = items[entry, NEXT]
    items[entry, NEXT] = heads[VACATED]
    heads[VACATED] = entry
    return items[entry, CELL]


@kernel
def search(
    state, clearance_m, nx, entry_cost, start, box, want, limit, shift, at, cost, link, touched, heads, items
):
    """Cheapest costs from `start`, cell by cell outwards, until `want` targets or `limit` are passed.

    Dial's bucket queue with buckets of 2**shift cost (Denardo and Fox 1979): for a flood they are no
    wider than the cheapest step, so that each cell is expanded once; an A* (Hart et al. 1968), whose
    order is by cost plus the octile distance to `box`, opens a cell again if a cheaper way turns up
    within its bucket. Both are exact when a bucket has been emptied. Diagonal steps need both
    4-neighbours (no corner cutting). The queue lives in `heads`, a power of two of buckets and two,
    and `items` (m, 2), its linked entries.

    `at` (4,) is how far the search is, see AT_BUCKET; before it begins, its N_TOUCHED cells are those of the
    last search, to be cleaned up. A search that a limit ended goes on if called again with a higher one.

    O(cells touched). Returns the cost below which all is exact, or OUT_OF_MEMORY if `items` was too short.
    """
    bins, ny, mask = entry_cost.size // 3, state.size // nx, heads.size - 3
    if at[N_WAITING] == NOT_BEGUN:
        for k in range(at[N_TOUCHED]):
            cost[touched[k]] = UNREACHED
        heads[:] = NO_ENTRY
        heads[N_USED] = 0
        touched[0] = start
        cost[start], link[start] = 0, (link[start] & TARGET) | OPEN
        at[AT_BUCKET] = octile(start % nx, start // nx, box) >> shift
        at[N_WAITING], at[N_SETTLED], at[N_TOUCHED] = 1, 0, 1
        _push(start, at[AT_BUCKET] & mask, heads, items)
    bucket, waiting, settled, n_touched = at[AT_BUCKET], at[N_WAITING], at[N_SETTLED], at[N_TOUCHED]
    passable, rows_per_cell = np.empty(8, np.bool_), 1.0 / nx
    exact_below = UNREACHED
    while waiting > 0:
        if heads[bucket & mask] == NO_ENTRY:
            if settled >= want or (bucket << shift) > limit:
                exact_below = (bucket + 1) << shift
                break
            bucket += 1
            continue
        cell = _pop(bucket & mask, heads, items)
        waiting -= 1
        if not link[cell] & OPEN:
            continue
        link[cell] &= ALL_BITS - OPEN
        settled += 1 if link[cell] & TARGET else 0
        so_far, iy = cost[cell], int((cell + 0.5) * rows_per_cell)  # quicker than a division
        ix = cell - iy * nx
        for direction in range(8):
            jx, jy = ix + STEP_X[direction], iy + STEP_Y[direction]
            passable[direction] = False
            if jx < 0 or jy < 0 or jx >= nx or jy >= ny:
                continue
            if direction >= 4 and not (passable[direction - 4] and passable[(direction - 3) & 3]):
                continue
            other = jy * nx + jx
            known = cost[other]
            if known <= so_far + STRAIGHT:  # no price makes this way cheaper
                passable[direction] = True
                continue
            step = price(other, state, clearance_m, entry_cost, bins)
            if step == 0:
                continue
            passable[direction] = True
            there = so_far + (step if direction < 4 else (step * DIAGONAL) >> STRAIGHT_BITS)
            if there >= known:
                continue
            if known == UNREACHED:
                touched[n_touched] = other
                n_touched += 1
            cost[other], link[other] = there, (link[other] & TARGET) | OPEN | direction
            if not _push(other, ((there + octile(jx, jy, box)) >> shift) & mask, heads, items):
                at[N_TOUCHED] = n_touched
                return OUT_OF_MEMORY
            waiting += 1
    at[AT_BUCKET], at[N_WAITING], at[N_SETTLED], at[N_TOUCHED] = bucket, waiting, settled, n_touched
    return exact_below


@kernel
def walk_back(cell, nx, link, start):
    """The cells from `start` to `cell` along the links of a search, (n,). O(n)."""
    steps = 0
    at = cell
    while at != start:
        direction = link[at] & DIRECTION
        at -= STEP_Y[direction] * nx + STEP_X[direction]
        steps += 1
    cells = np.empty(steps + 1, np.int32)
    at = cell
    for k in range(steps, 0, -1):
        cells[k] = at
        direction = link[at] & DIRECTION
        at -= STEP_Y[direction] * nx + STEP_X[direction]
    cells[0] = start
    return cells


@part
def line_cost(first, last, nx, state, clearance_m, entry_cost, dearest):
    """The cost of the straight line between two cells' centres; -1 if a cell costs 0 or more than `dearest`.

    Sampled twice a cell, O(length).
    """
    bins = entry_cost.size // 3
    x, y = first % nx, first // nx
    dx, dy = last % nx - x, last // nx - y
    samples = 2 * max(abs(dx), abs(dy))
    if samples == 0:
        return 0.0
    total = 0
    for k in range(1, samples + 1):
        ix = int(x + dx * k / samples + 0.5)
        iy = int(y + dy * k / samples + 0.5)
        step = price(iy * nx + ix, state, clearance_m, entry_cost, bins)
        if step == 0 or step > dearest:
            return -1.0
        total += step
    return total / samples * math.sqrt(dx * dx + dy * dy)


@kernel
def shortcut(cells, nx, state, clearance_m, entry_cost):
    """Which of a path's cells (n,) to keep so that straight lines between them cost no more than it did.

    The line counts its soft cost too, and enters no cell dearer than any that it replaces: a shortcut
    never buys length with clearance. From each kept cell the farthest in reach is taken; a few
    failures in a row end the look (a zigzag fails and works by turns). O(n * length of the lines).
    """
    bins = entry_cost.size // 3
    n = len(cells)
    paid, so_far = np.empty(n, np.int64), np.empty(n)
    paid[0], so_far[0] = 0, 0.0
    for k in range(1, n):
        paid[k] = price(cells[k], state, clearance_m, entry_cost, bins)
        is_straight = cells[k] % nx == cells[k - 1] % nx or cells[k] // nx == cells[k - 1] // nx
        so_far[k] = so_far[k - 1] + paid[k] * (1.0 if is_straight else DIAGONAL / STRAIGHT)
    kept = np.empty(n, np.int64)
    kept[0] = 0
    n_kept = 1
    at = 0
    while at < n - 1:
        best, failures, ahead = at + 1, 0, at + 2
        dearest = paid[at + 1]
        while ahead < n and failures < PATIENCE:
            dearest = max(dearest, paid[ahead])
            cost = line_cost(cells[at], cells[ahead], nx, state, clearance_m, entry_cost, dearest)
            if 0.0 <= cost <= (so_far[ahead] - so_far[at]) * TOLERANCE + SAMPLING_ERROR:
                best, failures = ahead, 0
            else:
                failures += 1
            ahead += 1
        kept[n_kept] = best
        n_kept += 1
        at = best
    return kept[:n_kept]


@kernel
def least_clearance(points, clearance_m, state, origin_x, origin_y, resolution_m, from_m, ample_m):
    """Along a polyline (n, 2) from `from_m` on: metres until clearance first reaches ample_m, then its least.

    Sampled twice a cell. Places outside the grid and occupied cells count as clearance 0. O(length).
    """
    ny, nx = clearance_m.shape
    lead_m, least = -1.0, np.inf
    begun = 0.0
    for k in range(len(points)):
        first = points[max(k - 1, 0)]
        dx, dy = points[k, 0] - first[0], points[k, 1] - first[1]
        length = math.sqrt(dx * dx + dy * dy)
        if begun + length >= from_m:
            samples = max(math.ceil(2.0 * length / resolution_m), 1)
            for i in range(1, samples + 1):
                along = length * i / samples
                if begun + along < from_m:
                    continue
                ix = math.floor((first[0] + dx * i / samples - origin_x) / resolution_m)
                iy = math.floor((first[1] + dy * i / samples - origin_y) / resolution_m)
                clear = 0.0
                if 0 <= ix < nx and 0 <= iy < ny and state[iy, ix] != OCCUPIED:
                    clear = clearance_m[iy, ix]
                if lead_m < 0.0:
                    if clear < ample_m:
                        continue
                    lead_m = begun + along
                least = min(least, clear)
        begun += length
    return (lead_m if lead_m >= 0.0 else begun), least
