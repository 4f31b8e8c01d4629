"""Kernels: where to look from, and what would be seen."""

from __future__ import annotations

import math

import numpy as np

from occmap.grid import OCCUPIED, UNKNOWN
from occmap.kernel import kernel, part

INSIDE_X, INSIDE_Y, DEPTH, EDGE_X, EDGE_Y = range(5)
TARGET_COLUMNS = 5
"""Of a target, what a look into a frontier is to reach: an unknown cell, how many steps deep it lies, and the
frontier cell that it lies behind."""
SPECK_CELLS = 1
"""A look may cross so many unknown cells in a row before the unknown that it is meant for. More is a wall
that beams have only grazed: a look through it shows nothing."""
MOUTH_CELLS = 3
"""A look enters the unknown no farther than this, and a quarter of its depth, from the frontier cell that it
is meant for."""


@kernel
def sees(state, x0, y0, x1, y1, most_unknown):
    """True if the line between two cells (Bresenham) meets nothing occupied and little unknown. O(distance).

    Nor does a look go between two occupied cells that touch at a corner.
    """
    return enters_at(state, x0, y0, x1, y1, most_unknown, most_unknown)[0]


@kernel
def sees_into(state, x0, y0, targets, k):
    """True if a look from a cell at the k-th of some targets goes into the unknown over their frontier.

    targets (n, 5), see TARGET_COLUMNS. The look goes as deep into the unknown as the target, through none
    before, and enters it near the frontier cell: what comes in elsewhere, by a dent of the same wall, does
    not show what is behind the frontier. Nor does a line along the edge of a shadow, which runs through the
    unknown for long. O(distance).
    """
    depth, slack = targets[k, DEPTH], targets[k, DEPTH] // 4
    is_clear, x, y = enters_at(
        state, x0, y0, targets[k, INSIDE_X], targets[k, INSIDE_Y], depth + slack + 1, SPECK_CELLS
    )
    near = slack + MOUTH_CELLS
    return is_clear and abs(x - targets[k, EDGE_X]) <= near and abs(y - targets[k, EDGE_Y]) <= near


@part
def is_walled_off(state, x, y, x0, y0):
    """Whether a line to cell (x0, y0) surely meets something occupied, and after how many cells of it this is
    known, told from its other end.

    From afar most lines end at walls around what they are meant for, and are found out sooner from there. The
    line itself may pass on either side of a cell's corner: both must be occupied. O(distance).
    """
    dx, dy = abs(x0 - x), abs(y0 - y)
    sx = 1 if x < x0 else -1
    sy = 1 if y < y0 else -1
    aside = 0  # how far the line is past y (x), in steps / max(dx, dy)
    length = max(dx, dy)
    for step in range(1, length):
        if dx >= dy:
            x += sx
            aside += dy
            if aside >= dx:
                aside -= dx
                y += sy
            beside = state[y + sy, x] if aside else OCCUPIED
        else:
            y += sy
            aside += dx
            if aside >= dy:
                aside -= dy
                x += sx
            beside = state[y, x + sx] if aside else OCCUPIED
        if state[y, x] == OCCUPIED and beside == OCCUPIED:
            return True, step
    return False, length


@part
def enters_at(state, x0, y0, x1, y1, most_unknown, most_left_behind):
    """(is_clear, x, y) of Bresenham's line from (x0, y0) to (x1, y1). O(distance).

    Clear: nothing occupied, at most most_unknown unknown cells, and no run of more than most_left_behind
    unknown cells that ends before the line does. (x, y): the first cell of the unknown run that the line
    ends in, else (x1, y1); if not clear, the cell that stopped it.
    """
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x0 < x1 else -1
    sy = 1 if y0 < y1 else -1
    error = dx - dy
    x, y = x0, y0
    unknown, in_a_row = 0, 0
    entry_x, entry_y = x1, y1
    while x != x1 or y != y1:
        doubled = 2 * error
        was_x, was_y = x, y
        if doubled > -dy:
            error -= dy
            x += sx
        if doubled < dx:
            error += dx
            y += sy
        is_diagonal = x != was_x and y != was_y
        if is_diagonal and state[was_y, x] == OCCUPIED and state[y, was_x] == OCCUPIED:
            return False, x, y
        here = state[y, x]
        if here == OCCUPIED:
            return False, x, y
        if here == UNKNOWN:
            if in_a_row == 0:
                entry_x, entry_y = x, y
            unknown += 1
            in_a_row += 1
            if unknown > most_unknown:
                return False, x, y
        elif in_a_row > most_left_behind:
            return False, x, y
        else:
            in_a_row = 0
            entry_x, entry_y = x1, y1
    return True, entry_x, entry_y


@kernel
def unknown_beyond(state, cells, limit, deepest):
    """Up to `limit` cells in the unknown beyond a frontier, spread evenly along it: targets (k, 5).

    Each lies straight beyond a frontier cell, `deepest` cells on or as far as the unknown goes.
    Unknown beside an occupied cell is a wall's rim: it is taken only where a frontier has nothing else.
    """
    clear = np.empty((limit, TARGET_COLUMNS), np.int64)
    rim = np.empty((limit, TARGET_COLUMNS), np.int64)
    n_clear, n_rim = 0, 0
    step = max(1.0, cells.shape[0] / limit)
    position = 0.5 * (step - 1.0)
    while position < cells.shape[0] and n_clear < limit:
        x, y = cells[int(position), 0], cells[int(position), 1]
        position += step
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            depth = unknown_depth(state, x, y, dx, dy, deepest)
            if depth == 0:
                continue
            if not beside_occupied(state, x + dx, y + dy):
                put_target(clear[n_clear], x, y, dx, dy, depth)
                n_clear += 1
                break
            if n_rim < limit:
                put_target(rim[n_rim], x, y, dx, dy, depth)
                n_rim += 1
    return clear[:n_clear] if n_clear else rim[:n_rim]


@part
def put_target(target, x, y, dx, dy, depth):
    """Note the cell so many steps behind a frontier's: see `sees_into`."""
    target[INSIDE_X], target[INSIDE_Y], target[DEPTH] = x + depth * dx, y + depth * dy, depth
    target[EDGE_X], target[EDGE_Y] = x, y


@part
def unknown_depth(state, x, y, dx, dy, deepest):
    """Unknown cells in a row from a cell on, at most `deepest`, within the array."""
    ny, nx = state.shape
    depth = 0
    while depth < deepest:
        ux, uy = x + (depth + 1) * dx, y + (depth + 1) * dy
        if ux < 0 or uy < 0 or ux >= nx or uy >= ny or state[uy, ux] != UNKNOWN:
            break
        depth += 1
    return depth


@part
def beside_occupied(state, x, y):
    """True if one of the eight neighbours is occupied."""
    ny, nx = state.shape
    for by in range(max(0, y - 1), min(ny, y + 2)):
        for bx in range(max(0, x - 1), min(nx, x + 2)):
            if state[by, bx] == OCCUPIED:
                return True
    return False


@kernel
def find_viewpoint(state, cost, exact_below, targets, needed, reach_cells, stride):
    """The cheapest reached cell from which at least `needed` of the targets (n, 5) are in line of sight.

    The body gets to cells that cost less than `exact_below`. Returns (ix, iy), or (-1, -1) if no cell
    sees enough within reach, and how many cells were looked at. Cost: one look-up a candidate, and lines of
    sight only for candidates that would be an improvement.
    """
    ny, nx = state.shape
    n = targets.shape[0]
    x_low, y_low = targets[0, INSIDE_X], targets[0, INSIDE_Y]
    x_high, y_high = x_low, y_low
    for k in range(n):
        x_low, x_high = min(x_low, targets[k, INSIDE_X]), max(x_high, targets[k, INSIDE_X])
        y_low, y_high = min(y_low, targets[k, INSIDE_Y]), max(y_high, targets[k, INSIDE_Y])
    x_low, x_high = max(0, x_low - reach_cells), min(nx, x_high + reach_cells + 1)
    y_low, y_high = max(0, y_low - reach_cells), min(ny, y_high + reach_cells + 1)
    reach_squared = reach_cells * reach_cells
    best, best_x, best_y = exact_below, -1, -1
    looked_at = 0
    for pace in (4 * stride, stride):  # what a coarse look finds spares the fine one most candidates
        if best_x >= 0:
            best += 1  # the first of equals is wanted
        for y in range(y_low, y_high, pace):
            looked_at += (x_high - x_low) // pace
            for x in range(x_low, x_high, pace):
                if not cost[y, x] < best:
                    continue
                seen = 0
                for k in range(n):
                    if seen + n - k < needed:
                        break
                    away_x, away_y = targets[k, INSIDE_X] - x, targets[k, INSIDE_Y] - y
                    if away_x * away_x + away_y * away_y > reach_squared:
                        continue
                    is_in_vain, followed = is_walled_off(
                        state, targets[k, INSIDE_X], targets[k, INSIDE_Y], x, y
                    )
                    looked_at += followed
                    if is_in_vain:
                        continue
                    looked_at += max(abs(away_x), abs(away_y))
                    if sees_into(state, x, y, targets, k):
                        seen += 1
                        if seen >= needed:
                            best, best_x, best_y = cost[y, x], x, y
                            break
    return best_x, best_y, looked_at


@kernel
def expected_gain_cells(state, x, y, range_cells, rays):
    """Unknown area, in cells, that a look around from a cell is expected to reveal.

    Rays cross free and unknown cells alike, end at occupied ones, and each unknown cell crossed
    stands for the sector it fills at its distance. Cost: rays x range; half-cell steps, so that no
    cell is stepped over. After González-Baños and Latombe, Navigation strategies for exploring indoor
    environments, IJRR 21, 2002: the potential gain of a view is the area that it may see past free edges.
    """
    ny, nx = state.shape
    gain = 0.0
    sector = 2.0 * math.pi / rays
    for k in range(rays):
        c, s = math.cos(k * sector), math.sin(k * sector)
        for i in range(1, 2 * range_cells + 1):
            r = 0.5 * i
            ix, iy = math.floor(x + 0.5 + r * c), math.floor(y + 0.5 + r * s)
            if ix < 0 or iy < 0 or ix >= nx or iy >= ny:
                gain += 0.5 * sector * (range_cells * range_cells - r * r)
                break
            here = state[iy, ix]
            if here == OCCUPIED:
                break
            if here == UNKNOWN:
                gain += 0.5 * r * sector
    return gain


@kernel
def share_with_neighbour(mask, cells, radius):
    """Share of the cells with a set cell of the mask within a square of the radius around them."""
    ny, nx = mask.shape
    found = 0
    for k in range(cells.shape[0]):
        x, y = cells[k, 0], cells[k, 1]
        hit = False
        for by in range(max(0, y - radius), min(ny, y + radius + 1)):
            for bx in range(max(0, x - radius), min(nx, x + radius + 1)):
                if mask[by, bx]:
                    hit = True
                    break
            if hit:
                break
        found += hit
    return found / max(1, cells.shape[0])


@kernel
def share_beside_unknown(state, cells):
    """Share of the cells that are free with an unknown 4-neighbour: frontier, a wall's rim or not.

    As for the frontier map, all is unknown beyond the array.
    """
    ny, nx = state.shape
    found = 0
    for k in range(cells.shape[0]):
        x, y = cells[k, 0], cells[k, 1]
        if x < 0 or y < 0 or x >= nx or y >= ny or state[y, x] == OCCUPIED or state[y, x] == UNKNOWN:
            continue
        beside = x == 0 or state[y, x - 1] == UNKNOWN or x == nx - 1 or state[y, x + 1] == UNKNOWN
        found += beside or y == 0 or state[y - 1, x] == UNKNOWN or y == ny - 1 or state[y + 1, x] == UNKNOWN
    return found / max(1, cells.shape[0])


@kernel
def unknown_inside(state, cells, least, deepest):
    """Cells deep in the unknown behind a narrow mouth: targets (k, 5), their depth in steps.

    From every cell of the mouth straight on in each of eight directions, `deepest` steps or as far as
    the unknown goes, and at least `least`: whichever way a slit runs, one of them is within 22.5 degrees.
    """
    found = np.empty((8 * cells.shape[0], TARGET_COLUMNS), np.int64)
    n = 0
    for k in range(cells.shape[0]):
        x, y = cells[k, 0], cells[k, 1]
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)):
            depth = unknown_depth(state, x, y, dx, dy, deepest)
            if depth >= least:
                put_target(found[n], x, y, dx, dy, depth)
                n += 1
    return found[:n]
