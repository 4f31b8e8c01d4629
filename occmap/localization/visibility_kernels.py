"""Kernel of views: points that a scan has met, and points that it looked straight through."""

from __future__ import annotations

import math

import numpy as np

from occmap.kernel import kernel, part

MET_M = 0.2
"""A beam that ends this near to a point has met it."""
PASSED_M = 0.4
"""Beams on both sides of a point that end this far behind it have passed it."""


@kernel
def look(points, lidar_x, lidar_y, lidar_yaw, bearings, ranges, met, passed):
    """Count for each of the points (n, 2) whether a scan met or else passed it, in met (n,) and passed (n,).

    bearings (b,) ascend; ranges (b,) are 0 where a beam says nothing. O(points * log beams).
    """
    for p in range(points.shape[0]):
        dx, dy = points[p, 0] - lidar_x, points[p, 1] - lidar_y
        distance = math.hypot(dx, dy)
        turn = math.atan2(dy, dx) - lidar_yaw - bearings[0]
        turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi))
        after = _first_from(bearings, bearings[0] + turn)
        if after < 1 or after >= bearings.shape[0]:
            continue
        nearest, is_met = np.inf, False
        for b in range(max(after - 2, 0), min(after + 2, bearings.shape[0])):
            if ranges[b] < nearest:
                nearest = ranges[b]
            if ranges[b] > 0.0 and abs(ranges[b] - distance) < MET_M:
                is_met = True
        if is_met:
            met[p] += 1
        elif nearest > distance + PASSED_M:
            passed[p] += 1


@part
def _first_from(values, least):
    """The index of the first of ascending values that is no less; their number if none is. O(log n).

    As np.searchsorted, which compiles for longer than all the rest.
    """
    low, high = 0, values.shape[0]
    while low < high:
        middle = (low + high) // 2
        if values[middle] < least:
            low = middle + 1
        else:
            high = middle
    return low
