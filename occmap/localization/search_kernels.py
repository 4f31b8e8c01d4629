"""Kernels of the correlative search: a likelihood raster, its pyramid of upper bounds, branch and bound.

A pyramid lives in one flat uint8 buffer. Level 0 is the raster. An entry (J, I) of level k > 0 is
the maximum over the 2h x 2h fine cells from ((I - 1) h, (J - 1) h) on, h = 2^k: whatever shift
from 0 to h - 1 cells moves a point of block I - 1, it lands in there. That is the bound that
branch and bound needs, at a third more memory than the raster alone.
"""

from __future__ import annotations

import numpy as np

from occmap.kernel import kernel, part


@kernel
def hits(bearings, ranges, least_m, most_m, x, y, yaw):
    """What beams (n,) from a lidar at (x, y, yaw) met, from least_m up to but without most_m away.

    Returns points (k, 2), unit vectors back to the lidar (k, 2) and the beams' numbers (k,).
    """
    points, facing = np.empty((ranges.shape[0], 2)), np.empty((ranges.shape[0], 2))
    beams = np.empty(ranges.shape[0], np.int64)
    k = 0
    for beam in range(ranges.shape[0]):
        if least_m <= ranges[beam] < most_m:
            c, s = np.cos(bearings[beam] + yaw), np.sin(bearings[beam] + yaw)
            points[k, 0], points[k, 1] = x + c * ranges[beam], y + s * ranges[beam]
            facing[k, 0], facing[k, 1] = -c, -s
            beams[k] = beam
            k += 1
    return points[:k], facing[:k], beams[:k]


@kernel
def spaced(points, spacing_m):
    """Which of points (n, 2) lie at least spacing_m from the last one kept, in order: their rows (k,)."""
    kept = np.empty(points.shape[0], np.int64)
    n = 0
    for k in range(points.shape[0]):
        if (
            n == 0
            or (points[k, 0] - points[kept[n - 1], 0]) ** 2 + (points[k, 1] - points[kept[n - 1], 1]) ** 2
            >= spacing_m * spacing_m
        ):
            kept[n] = k
            n += 1
    return kept[:n]


@kernel
def bridged(points, beams, spacing_m, most_m, off_m):
    """The points (n, 2) and more of them, spacing_m apart, along the walls that they were sampled from.

    A wall is assumed between the hits of neighbouring beams that are less than most_m apart and in
    line, to off_m, with a third hit next to them. Without it the pattern of beams on a plain wall,
    which travels with the robot, would fit best where the robot was before. O(points + output).
    """
    n = points.shape[0]
    count = n
    for k in range(n - 1):
        if _on_one_wall(points, beams, k, most_m, off_m):
            count += int(
                np.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]) / spacing_m
            )
    out = np.empty((count, 2))
    for k in range(n):  # to assign a slice compiles for two seconds
        out[k, 0], out[k, 1] = points[k, 0], points[k, 1]
    at = n
    for k in range(n - 1):
        if _on_one_wall(points, beams, k, most_m, off_m):
            dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
            more = int(np.hypot(dx, dy) / spacing_m)
            for i in range(more):
                share = (i + 1) / (more + 1)
                out[at, 0], out[at, 1] = points[k, 0] + share * dx, points[k, 1] + share * dy
                at += 1
    return out


@kernel
def _on_one_wall(points, beams, k, most_m, off_m):
    """Whether hits k and k + 1 lie on one wall: neighbours, near, in line with the hit before or after."""
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    length = np.hypot(dx, dy)
    if beams[k + 1] != beams[k] + 1 or length > most_m or length == 0.0:
        return False
    for other in (k - 1, k + 2):
        if 0 <= other < points.shape[0] and abs(beams[other] - beams[k]) <= 2:
            off = (dx * (points[other, 1] - points[k, 1]) - dy * (points[other, 0] - points[k, 0])) / length
            if abs(off) < off_m:
                return True
    return False


@kernel
def stamp(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, profile):
    """Press a peak round every point (n, 2) into all levels, keeping maxima.

    `profile` (r, r) uint8 falls with the distance in cells along both axes. O(points * r^2).
    """
    radius = profile.shape[0] - 1
    ny, nx = shapes[0, 0], shapes[0, 1]
    for p in range(points.shape[0]):
        cx = int(np.floor((points[p, 0] - origin_x) * cells_per_m))
        cy = int(np.floor((points[p, 1] - origin_y) * cells_per_m))
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
    """One peak, at level k: the peak falls with distance, so a block's maximum is at its nearest cell."""
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


@part
def _score(buffer, start, height, width, k, cells, shift_x, shift_y):
    """Sum over the cells (n, 2) of one angle, shifted, of a level's entries."""
    lift = 1 if k > 0 else 0
    total = 0
    for p in range(cells.shape[0]):
        i = ((cells[p, 0] + shift_x) >> k) + lift
        j = ((cells[p, 1] + shift_y) >> k) + lift
        if 0 <= i < width and 0 <= j < height:
            total += buffer[start + j * width + i]
    return total


def search(buffer, starts, shapes, points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step,
           half_cells, shift_cost, angle_cost, cost_cap, least, shun):  # fmt: skip
    """Best pose of points (n, 2) on the raster within a window round guess (x, y, yaw).

    The window is +-half_cells cells and +-half_angles steps of angle_step, but for the shifts within
    shun[2] cells of shun[:2]. The score is the sum of raster values less shift_cost * cells^2 +
    angle_cost * steps^2, at most cost_cap. Returns (angle step, cells in x, cells in y, score); score is
    `least` if nothing beats it. Depth-first branch and bound over translations, all angles at once
    (Olson 2009; Hess et al. 2016, algorithm 3).
    """
    top = min(len(starts) - 1, (2 * half_cells + 1).bit_length() - 1)
    costs = half_cells, shift_cost, angle_cost, cost_cap
    cells = _turned(points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step)
    bounds = _bounds(buffer, starts, shapes, cells, top, *costs)
    order = np.argsort(-bounds, kind="stable")  # not in a kernel: numba's takes a second to compile
    return _best_first(buffer, starts, shapes, cells, top, bounds, order, *costs, shun, float(least))


@kernel
def _turned(points, origin_x, origin_y, cells_per_m, guess, half_angles, angle_step):
    """The cells (angles, n, 2) that points fall into, unshifted. O(angles n)."""
    n_angles = 2 * half_angles + 1
    cells = np.empty((n_angles, points.shape[0], 2), np.int64)
    for a in range(n_angles):
        yaw = guess[2] + (a - half_angles) * angle_step
        c, s = np.cos(yaw), np.sin(yaw)
        for p in range(points.shape[0]):
            x = guess[0] + c * points[p, 0] - s * points[p, 1]
            y = guess[1] + s * points[p, 0] + c * points[p, 1]
            cells[a, p, 0] = int(np.floor((x - origin_x) * cells_per_m))
            cells[a, p, 1] = int(np.floor((y - origin_y) * cells_per_m))
    return cells


@kernel
def _bound(
    buffer, starts, shapes, cells, k, low_x, low_y, angle, half_cells, shift_cost, angle_cost, cost_cap
):
    """What no pose of the block of shifts [low, low + 2^k) can exceed; exact at level 0."""
    reach = (1 << k) - 1
    dx = max(low_x, -min(low_x + reach, half_cells), 0)
    dy = max(low_y, -min(low_y + reach, half_cells), 0)
    gain = _score(buffer, starts[k], shapes[k, 0], shapes[k, 1], k, cells, low_x, low_y)
    return gain - min(shift_cost * (dx * dx + dy * dy) + angle_cost * angle * angle, cost_cap)


@kernel
def _bounds(buffer, starts, shapes, cells, top, half_cells, shift_cost, angle_cost, cost_cap):
    """The bound (angles * blocks^2,) of each block of the top level."""
    n_angles = cells.shape[0]
    blocks = (2 * half_cells >> top) + 1
    bounds = np.empty(n_angles * blocks * blocks)
    for a in range(n_angles):
        for j in range(blocks):
            for i in range(blocks):
                bounds[(a * blocks + j) * blocks + i] = _bound(
                    buffer, starts, shapes, cells[a], top, (i << top) - half_cells, (j << top) - half_cells,
                    a - n_angles // 2, half_cells, shift_cost, angle_cost, cost_cap)  # fmt: skip
    return bounds


@kernel
def _best_first(buffer, starts, shapes, cells, top, bounds, order, half_cells, shift_cost, angle_cost,
                cost_cap, shun, least):  # fmt: skip
    """Look into the blocks, the most promising first, until none can beat what was found."""
    blocks = (2 * half_cells >> top) + 1
    best_angle, best_x, best_y, best = 0, 0, 0, least
    stack = np.empty((4 * (top + 2), 3), np.int64)
    stack_bound = np.empty(4 * (top + 2))
    for node in order:
        if bounds[node] <= best:
            break
        a = node // (blocks * blocks)
        angle = a - cells.shape[0] // 2
        i, j = node % blocks, (node // blocks) % blocks
        size = 1
        stack[0, 0], stack[0, 1], stack[0, 2], stack_bound[0] = top, (i << top), (j << top), bounds[node]
        while size > 0:  # depth first below the block, the most promising child first
            size -= 1
            k, x, y = stack[size, 0], stack[size, 1], stack[size, 2]
            if stack_bound[size] <= best:
                continue
            if k == 0:
                if max(abs(x - half_cells - shun[0]), abs(y - half_cells - shun[1])) > shun[2]:
                    best_angle, best_x, best_y = angle, x - half_cells, y - half_cells
                    best = stack_bound[size]
                continue
            first = size
            h = 1 << (k - 1)
            for child in range(4):
                cx, cy = x + (child & 1) * h, y + (child >> 1) * h
                if cx > 2 * half_cells or cy > 2 * half_cells:
                    continue
                value = _bound(buffer, starts, shapes, cells[a], k - 1, cx - half_cells, cy - half_cells,
                               angle, half_cells, shift_cost, angle_cost, cost_cap)  # fmt: skip
                if value > best:
                    _push(stack, stack_bound, first, size, k - 1, cx, cy, value)
                    size += 1
    return best_angle, best_x, best_y, best


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
