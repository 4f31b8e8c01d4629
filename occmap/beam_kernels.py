"""Kernels of the mapper: which beams say something, and where they end."""

from __future__ import annotations

import math

import numpy as np

from occmap.grid import MOST_HITS
from occmap.kernel import kernel, part

NEIGHBOURS_RAD = 0.1
"""Beams farther apart look at different things."""


@part
def is_lone(bearings, ranges, min_range, max_range, k, company):
    """Whether beam k met nothing with fewer than `company` neighbours like it, between beams that returned.

    Beams that failed are looked past; a neighbour more than NEIGHBOURS_RAD away flanks nothing. O(company).
    """
    n, run = ranges.shape[0], 1
    for step in (-1, 1):
        at, last = k, k
        while True:
            at = (at + step) % n
            if at == k:
                return False
            gap = abs(bearings[at] - bearings[last]) % (2.0 * math.pi)
            if min(gap, 2.0 * math.pi - gap) > NEIGHBOURS_RAD:
                return False
            if not ranges[at] >= min_range:
                continue
            if ranges[at] < max_range:
                break
            run, last = run + 1, at
            if run >= company:
                return False
    return run < company


@kernel
def beam_ends(bearings, ranges, min_range, max_range, usable_range, company, x, y, yaw):
    """The places where the beams that say something start and end, in metres in the map frame. O(n).

    Beams are spent as far as usable_range; those that met nothing only in company (see is_lone).

    Returns the points (1 + k, 2), the sensor's first; which of the k ends are hits; and the box (low
    x, low y, high x, high y) of all points.
    """
    points = np.empty((1 + ranges.shape[0], 2))
    hit = np.empty(ranges.shape[0], np.bool_)
    points[0, 0], points[0, 1] = x, y
    low_x, low_y, high_x, high_y = x, y, x, y
    n = 0
    for k in range(ranges.shape[0]):
        if not ranges[k] >= min_range:  # also nan
            continue
        if ranges[k] >= max_range and is_lone(bearings, ranges, min_range, max_range, k, company):
            continue
        reach = min(max_range, usable_range)
        hit[n] = ranges[k] < reach
        z = min(ranges[k], reach)
        end_x, end_y = x + z * math.cos(yaw + bearings[k]), y + z * math.sin(yaw + bearings[k])
        low_x, high_x = min(low_x, end_x), max(high_x, end_x)
        low_y, high_y = min(low_y, end_y), max(high_y, end_y)
        n += 1
        points[n, 0], points[n, 1] = end_x, end_y
    return points[: n + 1], hit[:n], (low_x, low_y, high_x, high_y)


@kernel
def count_hits(points, hit, ix0, iy0, hits, solid):
    """Count in hits (ny, nx) uint8, up to MOST_HITS, the cells in which beams ended. O(n).

    points (1 + n, 2): the sensor and the beams' ends in cells of a window whose cell (0, 0) is grid cell
    (ix0, iy0); hit (n,): which ends are hits. Returns (k,) flat indices of the cells whose count has just
    become 1 or `solid`.
    """
    nx = hits.shape[1]
    now_struck = np.empty(hit.shape[0], np.int32)
    n = 0
    for k in range(hit.shape[0]):
        ix, iy = math.floor(points[k + 1, 0]) + ix0, math.floor(points[k + 1, 1]) + iy0
        if not hit[k] or hits[iy, ix] == MOST_HITS:
            continue
        hits[iy, ix] += np.uint8(1)
        if hits[iy, ix] == 1 or hits[iy, ix] == solid:
            now_struck[n] = iy * nx + ix
            n += 1
    return now_struck[:n].copy()
