"""Kernels of the mapper: which cells a beam votes on, and how.

Misses are counted in a window, a flat array of 16-bit counters, `stride` to a row. Hit cells are few:
they are listed as (ix, iy) of the window.
"""

from __future__ import annotations

import math

import numpy as np

from occmap import sensor_model
from occmap.kernel import kernel, part
from occmap.rays import ray_cells

vote = kernel(sensor_model.vote)

FRACTION_BITS = 40
"""Of the fixed-point numbers that rays are followed in."""


@part
def count_ray(window, stride, ix0, iy0, ix1, iy1):
    """Count one miss for every cell of a ray but its last.

    The cells of Bresenham's line (rays.ray_cells), where the shorter axis stands at ceil(k * short /
    long - 1/2) after k steps. Here as a fixed-point product: no step waits for the error of the one
    before, which halves the time. Exact for rays of up to 2^19 cells. O(cells).
    """
    dx, dy = abs(ix1 - ix0), abs(iy1 - iy0)
    step_x = 1 if ix1 > ix0 else -1
    step_y = stride if iy1 > iy0 else -stride
    if dx >= dy:
        long, short, ahead, aside = dx, dy, step_x, step_y
    else:
        long, short, ahead, aside = dy, dx, step_y, step_x
    at = iy0 * stride + ix0
    slope = (short << FRACTION_BITS) // max(long, 1)
    # just under one half: a ray through a corner stays on its side of it
    rise = (1 << (FRACTION_BITS - 1)) - 1
    for _ in range(long):
        window[np.uint64(at + (rise >> FRACTION_BITS) * aside)] += np.uint16(1)
        at += ahead
        rise += slope


@part
def lines(window, stride, points, hit, alpha, hits):
    """Count the votes of thin beams: misses into the window, end cells into hits. Everything in window cells.

    A hit is alpha cells thick to either side of its end. O(sum of beam lengths in cells). Returns
    the number of hit cells.
    """
    n_hits = 0
    x, y = points[0, 0], points[0, 1]
    ix0, iy0 = math.floor(x), math.floor(y)
    for k in range(hit.shape[0]):
        end_x, end_y = points[k + 1, 0], points[k + 1, 1]
        depth = 0.0
        if hit[k] and alpha > 0.0:
            depth = min(1.0, alpha / max(alpha, math.hypot(end_x - x, end_y - y)))
        deep_x, deep_y = depth * (end_x - x), depth * (end_y - y)
        ix1, iy1 = math.floor(end_x - deep_x), math.floor(end_y - deep_y)
        count_ray(window, stride, ix0, iy0, ix1, iy1)
        if not hit[k]:
            window[iy1 * stride + ix1] += np.uint16(1)
            continue
        hits[n_hits, 0], hits[n_hits, 1] = ix1, iy1
        n_hits += 1
        if depth > 0.0:
            band = ray_cells(ix1, iy1, math.floor(end_x + deep_x), math.floor(end_y + deep_y))
            for i in range(1, band.shape[0]):
                hits[n_hits, 0], hits[n_hits, 1] = band[i, 0], band[i, 1]
                n_hits += 1
    return n_hits


@kernel
def cones(window, stride, points, hit, half_width, alpha, hits):
    """Count the votes of beams that open by half_width (rad) to either side; everything in window cells.

    Every cell whose centre lies in the wedge (or within half a cell of its axis, where the wedge is
    narrower than a cell) is voted on by its distance from the sensor. O(area of the beams' bounding
    boxes). Returns the number of hit cells.
    """
    n_hits = 0
    x, y, slope = points[0, 0], points[0, 1], math.tan(half_width)
    for k in range(hit.shape[0]):
        dx, dy = points[k + 1, 0] - x, points[k + 1, 1] - y
        z = math.hypot(dx, dy)
        cos, sin = (dx / z, dy / z) if z > 0.0 else (1.0, 0.0)
        reach = z + (alpha if hit[k] else 0.0)
        z_max = np.inf if hit[k] else z
        pad = max(reach * slope, 0.5)
        tip_x, tip_y = x + cos * reach, y + sin * reach
        for iy in range(math.floor(min(y, tip_y) - pad), math.floor(max(y, tip_y) + pad) + 1):
            for ix in range(math.floor(min(x, tip_x) - pad), math.floor(max(x, tip_x) + pad) + 1):
                cx, cy = ix + 0.5 - x, iy + 0.5 - y
                along, across = cx * cos + cy * sin, abs(cy * cos - cx * sin)
                if along < -0.5 or across > max(along * slope, 0.5):
                    continue
                said = vote(math.hypot(cx, cy), z, z_max, alpha)
                if said < 0:
                    window[iy * stride + ix] += np.uint16(1)
                elif said > 0:
                    hits[n_hits, 0], hits[n_hits, 1] = ix, iy
                    n_hits += 1
    return n_hits
