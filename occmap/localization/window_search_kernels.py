"""Kernels of the search that can be interrupted: bounds first, then the most promising blocks, in slices.

The same branch and bound as search_kernels.search, without a prediction that weighs in: what is looked
for may be anywhere in the window.
"""

from __future__ import annotations

import numpy as np

from occmap.kernel import kernel
from occmap.localization.search_kernels import _push, _score


@kernel
def bounds(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
           half_cells, top, first, last, out):  # fmt: skip
    """Fill out[first:last] (angles, blocks, blocks) with what no pose of a block can exceed.

    A block is 2^top shifts wide, in cells from -half_cells on. O((last - first) * blocks^2 * points).
    """
    blocks = out.shape[1]
    for a in range(first, last):
        cells = cells_of(points, origin_x, origin_y, cells_per_m, guess, (a - half_angles) * angle_step)
        for j in range(blocks):
            for i in range(blocks):
                out[a, j, i] = _score(buffer, starts[top], shapes[top, 0], shapes[top, 1], top, cells,
                                      (i << top) - half_cells, (j << top) - half_cells)  # fmt: skip


@kernel
def descend(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
            half_cells, top, out, order, begin, best, shun, work, any_will_do):  # fmt: skip
    """Search the blocks of `order` from `begin` on, below bounds `out`, until so many points were scored.

    best (4,) is the best (angle step, cells in x, cells in y, score) so far, and is improved on; shifts
    within shun[2] cells of shun[:2] do not count. Returns where to go on, len(order) when all is done, and
    the work left. With any_will_do the first pose that beats `best` ends it.
    """
    blocks = out.shape[1]
    stack = np.empty((4 * (top + 2), 3), np.int64)
    stack_bound = np.empty(4 * (top + 2), np.int64)
    for at in range(begin, order.shape[0]):
        if work <= 0:
            return at, work
        node = order[at]
        a, j, i = node // (blocks * blocks), (node // blocks) % blocks, node % blocks
        if out[a, j, i] <= best[3]:
            return order.shape[0], work
        cells = cells_of(points, origin_x, origin_y, cells_per_m, guess, (a - half_angles) * angle_step)
        stack[0, 0], stack[0, 1], stack[0, 2], stack_bound[0] = top, i << top, j << top, out[a, j, i]
        size = 1
        while size > 0:
            size -= 1
            k, x, y = stack[size, 0], stack[size, 1], stack[size, 2]
            if stack_bound[size] <= best[3]:
                continue
            if k == 0:
                if max(abs(x - half_cells - shun[0]), abs(y - half_cells - shun[1])) > shun[2]:
                    best[0], best[1], best[2] = a - half_angles, x - half_cells, y - half_cells
                    best[3] = stack_bound[size]
                    if any_will_do:
                        return at + 1, work
                continue
            first, h = size, 1 << (k - 1)
            for child in range(4):
                cx, cy = x + (child & 1) * h, y + (child >> 1) * h
                if cx > 2 * half_cells or cy > 2 * half_cells:
                    continue
                work -= points.shape[0]
                value = _score(buffer, starts[k - 1], shapes[k - 1, 0], shapes[k - 1, 1], k - 1, cells,
                               cx - half_cells, cy - half_cells)  # fmt: skip
                if value <= best[3]:
                    continue
                _push(stack, stack_bound, first, size, k - 1, cx, cy, value)
                size += 1
    return order.shape[0], work


@kernel
def cells_of(points, origin_x, origin_y, cells_per_m, guess, turn):
    """(n, 2) the raster's cells of points (n, 2), moved by guess (x, y, yaw) and turned on."""
    c, s = np.cos(guess[2] + turn), np.sin(guess[2] + turn)
    cells = np.empty((points.shape[0], 2), np.int64)
    for p in range(points.shape[0]):
        x = guess[0] + c * points[p, 0] - s * points[p, 1]
        y = guess[1] + s * points[p, 0] + c * points[p, 1]
        cells[p, 0] = int(np.floor((x - origin_x) * cells_per_m))
        cells[p, 1] = int(np.floor((y - origin_y) * cells_per_m))
    return cells
