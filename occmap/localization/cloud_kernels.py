"""Kernels of a cloud: a scan's hits, fewer of them where they crowd, more of them along walls."""

from __future__ import annotations

import math

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
            c, s = math.cos(bearings[beam] + yaw), math.sin(bearings[beam] + yaw)
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
        if n > 0:
            dx, dy = points[k, 0] - points[kept[n - 1], 0], points[k, 1] - points[kept[n - 1], 1]
            if dx * dx + dy * dy < spacing_m * spacing_m:
                continue
        kept[n] = k
        n += 1
    return kept[:n]


@kernel
def bridged(points, facing, beams, spacing_m, most_m, off_m):
    """The points (n, 2) and more of them, spacing_m apart, along the walls that they were sampled from.

    Returns them (m, 2) and the unit vectors back to the lidar (m, 2), those of the points given first.

    A wall is assumed between the hits of neighbouring beams that are less than most_m apart and in
    line, to off_m, with a third hit next to them. Without it the pattern of beams on a plain wall,
    which travels with the robot, would fit best where the robot was before. O(points + output).
    """
    n = points.shape[0]
    between, count = np.empty(max(n - 1, 0), np.int64), n
    for k in range(n - 1):
        dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        is_wall = _is_on_one_wall(points, beams, k, most_m, off_m)
        between[k] = int(math.hypot(dx, dy) / spacing_m) if is_wall else 0
        count += between[k]
    out, back = np.empty((count, 2)), np.empty((count, 2))
    for k in range(n):  # to assign a slice compiles for two seconds
        out[k, 0], out[k, 1] = points[k, 0], points[k, 1]
        back[k, 0], back[k, 1] = facing[k, 0], facing[k, 1]
    at = n
    for k in range(n - 1):
        for i in range(between[k]):
            here = (i + 1) / (between[k] + 1)
            before = 1.0 - here
            x = before * facing[k, 0] + here * facing[k + 1, 0]
            y = before * facing[k, 1] + here * facing[k + 1, 1]
            length = math.hypot(x, y)
            back[at, 0], back[at, 1] = x / length, y / length
            out[at, 0] = before * points[k, 0] + here * points[k + 1, 0]
            out[at, 1] = before * points[k, 1] + here * points[k + 1, 1]
            at += 1
    return out, back


@part
def _is_on_one_wall(points, beams, k, most_m, off_m):
    """Whether hits k and k + 1 lie on one wall: neighbours, near, in line with the hit before or after."""
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    length = math.hypot(dx, dy)
    if beams[k + 1] != beams[k] + 1 or length > most_m or length == 0.0:
        return False
    for other in (k - 1, k + 2):
        if 0 <= other < points.shape[0] and abs(beams[other] - beams[k]) <= 2:
            off = (dx * (points[other, 1] - points[k, 1]) - dy * (points[other, 0] - points[k, 0])) / length
            if abs(off) < off_m:
                return True
    return False
