"""Kernels of the correlative search: a likelihood raster, its pyramid of upper bounds, branch and bound.

A pyramid lives in one flat uint8 buffer. Level 0 is the raster. An entry (J, I) of level k > 0 is
the maximum over the 2h x 2h fine cells from ((I - 1) h, (J - 1) h) on, h = 2^k: whatever shift
from 0 to h - 1 cells moves a point of block I - 1, it lands in there. That is the bound that
branch and bound needs, at a third more memory than the raster alone.
"""

from __future__ import annotations

import math

import numpy as np

from occmap.kernel import kernel, part
from occmap.localization.likelihood_pyramid import top_blocks
from occmap.localization.window import SCORE, SHIFT_X, SHIFT_Y, TURN

NO_END = 2**62
"""Of work: more than any search takes."""


@kernel
def stamp(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, profile):
    """Press a peak round every point (n, 2) into all levels, keeping maxima.

    `profile` (r, r) uint8 falls with the distance in cells along both axes. O(points * r^2).
    """
    radius = profile.shape[0] - 1
    ny, nx = shapes[0, 0], shapes[0, 1]
    for p in range(points.shape[0]):
        cx = math.floor((points[p, 0] - origin_x) * cells_per_m)
        cy = math.floor((points[p, 1] - origin_y) * cells_per_m)
        if cx < radius or cy < radius or cx >= nx - radius or cy >= ny - radius:
            continue
        if buffer[starts[0] + cy * nx + cx] == profile[0, 0]:
            continue  # an earlier point stood in the same cell
        for y in range(cy - radius, cy + radius + 1):
            row = starts[0] + y * nx
            for x in range(cx - radius, cx + radius + 1):
                value = profile[abs(y - cy), abs(x - cx)]
                if value > buffer[row + x]:
                    buffer[row + x] = value
        for k in range(1, starts.shape[0]):
            _stamp_bound(buffer, starts[k], shapes[k, 1], k, cx, cy, profile)


@part
def _stamp_bound(buffer, start, width, k, cx, cy, profile):
    """Press one peak into level k: it falls with distance, so a block's maximum is at its nearest cell."""
    radius = profile.shape[0] - 1
    h = 1 << k
    for j in range((cy - radius) >> k, ((cy + radius) >> k) + 2):
        dy = max((j - 1) * h - cy, cy - (j + 1) * h + 1, 0)
        if dy > radius:
            continue
        for i in range((cx - radius) >> k, ((cx + radius) >> k) + 2):
            dx = max((i - 1) * h - cx, cx - (i + 1) * h + 1, 0)
            if dx > radius:
                continue
            at = start + j * width + i
            if profile[dy, dx] > buffer[at]:
                buffer[at] = profile[dy, dx]


def search(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
           half_cells, shift_cost, angle_cost, cost_cap, least, shun):  # fmt: skip
    """Best pose of points (n, 2) on the raster within a window round guess (x, y, yaw), all in one go.

    The window is +-half_cells cells and +-half_angles steps of angle_step, but for the shifts within
    shun[2] cells of shun[:2]. The score is the sum of raster values less shift_cost * cells^2 +
    angle_cost * steps^2, at most cost_cap. Returns (angle step, cells in x, cells in y, score); score is
    `least` if nothing beats it.
    """
    top, blocks = top_blocks(half_cells)
    costs = float(shift_cost), float(angle_cost), float(cost_cap)
    problem = (buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles,
               angle_step, half_cells, top, costs)  # fmt: skip
    n_angles = 2 * half_angles + 1
    bound, best = np.empty((n_angles, blocks, blocks)), np.array([0.0, 0.0, 0.0, least])
    bounds(*problem, 0, n_angles, bound)
    order = np.argsort(-bound, axis=None, kind="stable")  # not in a kernel: numba's takes a second to compile
    descend(*problem, bound, order, 0, best, shun, NO_END, False)
    angle, x, y, score = best.tolist()
    return int(angle), int(x), int(y), score


@kernel
def bounds(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
           half_cells, top, costs, first, last, out):  # fmt: skip
    """Fill out[first:last] (angles, blocks, blocks) with what no pose of a block can exceed.

    A block is 2^top shifts wide, in cells from -half_cells on. O((last - first) * blocks^2 * points).
    """
    cells = np.empty(points.shape, np.int64)
    for a in range(first, last):
        angle = a - half_angles
        _turn(points, origin_x, origin_y, cells_per_m, guess, angle * angle_step, cells)
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                out[a, j, i] = _bound(buffer, starts, shapes, cells, top, (i << top) - half_cells,
                                      (j << top) - half_cells, angle, half_cells, costs)  # fmt: skip


@kernel
def descend(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
            half_cells, top, costs, out, order, begin, best, shun, work, any_will_do):  # fmt: skip
    """Search the blocks of `order` from `begin` on, below bounds `out`, until so many points were scored.

    Depth-first branch and bound over translations, all angles at once (Olson 2009; Hess et al. 2016,
    algorithm 3). best (4,) is the best (angle step, cells in x, cells in y, score) so far, and is improved
    on; shifts within shun[2] cells of shun[:2] do not count. Returns where to go on, len(order) when all is
    done, and the work left. With any_will_do the first pose that beats `best` ends it.
    """
    n_angles, blocks = out.shape[0], out.shape[1]
    n = points.shape[0]
    cells, is_turned = np.empty((n_angles * n, 2), np.int64), np.empty(n_angles, np.int64)
    for a in range(n_angles):
        is_turned[a] = 0
    stack, stack_bound = np.empty((4 * (top + 2), 3), np.int64), np.empty(4 * (top + 2))
    for at in range(begin, order.shape[0]):
        if work <= 0:
            return at, work
        node = order[at]
        a, j, i = node // (blocks * blocks), (node // blocks) % blocks, node % blocks
        if out[a, j, i] <= best[SCORE]:
            break
        mine, size = cells[a * n : (a + 1) * n], 1
        if not is_turned[a]:
            _turn(points, origin_x, origin_y, cells_per_m, guess, (a - half_angles) * angle_step, mine)
            is_turned[a] = 1
        stack[0, 0], stack[0, 1], stack[0, 2], stack_bound[0] = top, i << top, j << top, out[a, j, i]
        while size > 0:  # depth first below the block, the most promising child first
            size -= 1
            k, x, y = stack[size, 0], stack[size, 1], stack[size, 2]
            if stack_bound[size] <= best[SCORE]:
                continue
            if k == 0:
                if max(abs(x - half_cells - shun[0]), abs(y - half_cells - shun[1])) > shun[2]:
                    best[TURN], best[SHIFT_X], best[SHIFT_Y] = a - half_angles, x - half_cells, y - half_cells
                    best[SCORE] = stack_bound[size]
                    if any_will_do:
                        return at + 1, work
                continue
            first, h = size, 1 << (k - 1)
            for child in range(4):
                cx, cy = x + (child & 1) * h, y + (child >> 1) * h
                if cx > 2 * half_cells or cy > 2 * half_cells:
                    continue
                work -= n
                value = _bound(buffer, starts, shapes, mine, k - 1, cx - half_cells, cy - half_cells,
                               a - half_angles, half_cells, costs)  # fmt: skip
                if value > best[SCORE]:
                    _push(stack, stack_bound, first, size, k - 1, cx, cy, value)
                    size += 1
    return order.shape[0], work


@kernel
def _turn(points, origin_x, origin_y, cells_per_m, guess, turn, cells):
    """Fill cells (n, 2) with the raster's cells of points (n, 2), moved by guess (x, y, yaw), turned on."""
    c, s = math.cos(guess[2] + turn), math.sin(guess[2] + turn)
    for p in range(points.shape[0]):
        x = guess[0] + c * points[p, 0] - s * points[p, 1]
        y = guess[1] + s * points[p, 0] + c * points[p, 1]
        cells[p, 0] = math.floor((x - origin_x) * cells_per_m)
        cells[p, 1] = math.floor((y - origin_y) * cells_per_m)


@kernel
def _bound(buffer, starts, shapes, cells, k, low_x, low_y, angle, half_cells, costs):
    """Score that no pose of the block of shifts [low, low + 2^k) can exceed; exact at level 0.

    The sum over the cells (n, 2) of one angle, shifted, of a level's entries, less the cost of the shift
    in the block that is nearest to none: costs are a cell's squared, an angle step's squared, and the most.
    """
    start, height, width = starts[k], shapes[k, 0], shapes[k, 1]
    lift = 1 if k > 0 else 0
    total = 0
    for p in range(cells.shape[0]):
        i = ((cells[p, 0] + low_x) >> k) + lift
        j = ((cells[p, 1] + low_y) >> k) + lift
        if 0 <= i < width and 0 <= j < height:
            total += buffer[start + j * width + i]
    shift_cost, angle_cost, cost_cap = costs
    reach = (1 << k) - 1
    dx = max(low_x, -min(low_x + reach, half_cells), 0)
    dy = max(low_y, -min(low_y + reach, half_cells), 0)
    return total - min(shift_cost * (dx * dx + dy * dy) + angle_cost * angle * angle, cost_cap)


@part
def _push(stack, stack_bound, first, size, k, x, y, bound):
    """Insert a node above `first` so that the best ends on top. Cell by cell: rows compile slowly."""
    at = size
    while at > first and stack_bound[at - 1] > bound:
        for c in range(3):
            stack[at, c] = stack[at - 1, c]
        stack_bound[at] = stack_bound[at - 1]
        at -= 1
    stack[at, 0], stack[at, 1], stack[at, 2], stack_bound[at] = k, x, y, bound
