"""Kernels of the compass: surfels of walls, seen along one direction, fall into sharp lines.

For what surfels (n, COLUMNS) hold see surfel_rows. A wall's side is which of the four directions, a
quarter turn apart, its normal is near to; the offset is how far along that direction it lies.
"""

from __future__ import annotations

import math

import numpy as np

from occmap.kernel import kernel, part
from occmap.localization.surfel_rows import (
    COUNT,
    FLAT,
    FLATNESS,
    MEAN_X,
    MEAN_Y,
    MOST_COUNT,
    NORMAL_X,
    NORMAL_Y,
)

W, WU, WV, WUU, WUV = range(5)
"""A line's sums, of weight times what is along it (u) and off the origin (v)."""
SUMS = 5


@kernel
def _side(row, c, s, cosine):
    """0 to 3: which of four directions a surfel faces; -1 if none within the angle of this cosine."""
    along, across = c * row[NORMAL_X] + s * row[NORMAL_Y], c * row[NORMAL_Y] - s * row[NORMAL_X]
    if along > cosine:
        return 0
    if across > cosine:
        return 1
    if along < -cosine:
        return 2
    if across < -cosine:
        return 3
    return -1


@kernel
def _weight(row, least_count):
    return min(row[COUNT], MOST_COUNT) if row[FLATNESS] > FLAT and row[COUNT] >= least_count else 0.0


@kernel
def offsets(surfels, yaw, cosine, least_count, cell_m, reach_m, histogram):
    """Fills histogram (4, bins) with the walls' weight by side and offset; returns that of all walls."""
    histogram[:, :] = 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    total = 0.0
    for p in range(surfels.shape[0]):
        row = surfels[p]
        weight = _weight(row, least_count)
        total += weight
        side = _side(row, c, s, cosine) if weight > 0.0 else -1
        if side < 0:
            continue
        offset = c * row[MEAN_X] + s * row[MEAN_Y] if side % 2 == 0 else c * row[MEAN_Y] - s * row[MEAN_X]
        place = (offset + reach_m) / cell_m
        k = math.floor(place)
        if 0 <= k < histogram.shape[1] - 1:
            histogram[side, k] += weight * (1.0 - (place - k))
            histogram[side, k + 1] += weight * (place - k)
    return total


@kernel
def sharpest(surfels, yaw, steps, step_rad, cosine, least_count, cell_m, reach_m):
    """The yaw, at most so many steps from another, at which the walls fall into the sharpest lines.

    Sharp is a large sum of squares of the histogram of offsets. O(surfels * steps).
    """
    histogram = np.empty((4, int(2.0 * reach_m / cell_m) + 2))
    best, best_sum = yaw, -1.0
    for k in range(-steps, steps + 1):
        offsets(surfels, yaw + k * step_rad, cosine, least_count, cell_m, reach_m, histogram)
        total = 0.0
        for side in range(4):
            for b in range(histogram.shape[1]):
                total += histogram[side, b] * histogram[side, b]
        if total > best_sum:
            best, best_sum = yaw + k * step_rad, total
    return best


@kernel
def straighten(surfels, yaw, iterations, cosine, least_count, cell_m, reach_m, least_wall):
    """The yaw nearby at which the lines are straightest: least squares of all lines' common slope.

    Returns (yaw, sum of weight * distance^2 along the lines, share of the walls' weight that lies in lines).
    """
    bins = int(2.0 * reach_m / cell_m) + 2
    histogram = np.empty((4, bins))
    line = np.empty((4, bins), np.int64)
    inertia = share = 0.0
    for _ in range(iterations):
        total = offsets(surfels, yaw, cosine, least_count, cell_m, reach_m, histogram)
        lines = _peaks(histogram, line, least_wall)
        sums = np.empty((lines, SUMS))
        sums[:, :] = 0.0
        c, s = math.cos(yaw), math.sin(yaw)
        for p in range(surfels.shape[0]):
            row = surfels[p]
            weight = _weight(row, least_count)
            side = _side(row, c, s, cosine) if weight > 0.0 else -1
            if side < 0:
                continue
            x, y = c * row[MEAN_X] + s * row[MEAN_Y], c * row[MEAN_Y] - s * row[MEAN_X]
            offset, along = (x, y) if side % 2 == 0 else (y, -x)
            k = math.floor((offset + reach_m) / cell_m + 0.5)
            if 0 <= k < bins and line[side, k] >= 0:
                at = sums[line[side, k]]
                at[W] += weight
                at[WU] += weight * along
                at[WV] += weight * offset
                at[WUU] += weight * along * along
                at[WUV] += weight * along * offset
        inertia = slope = inside = 0.0
        for at in sums:
            if at[W] > 0.0:
                inside += at[W]
                inertia += at[WUU] - at[WU] * at[WU] / at[W]
                slope += at[WUV] - at[WU] * at[WV] / at[W]
        if inertia <= 0.0:
            return yaw, 0.0, 0.0
        share = inside / total
        yaw -= slope / inertia
    return yaw, inertia, share


@part
def _peaks(histogram, line, least_wall):
    """Numbers the maxima of (4, bins) that weigh enough; their bins and both neighbours go to `line`."""
    line[:, :] = -1
    lines = 0
    bins = histogram.shape[1]
    for side in range(4):
        h = histogram[side]
        for b in range(2, bins - 2):
            here = 0.5 * h[b - 1] + h[b] + 0.5 * h[b + 1]
            before = 0.5 * h[b - 2] + h[b - 1] + 0.5 * h[b]
            after = 0.5 * h[b] + h[b + 1] + 0.5 * h[b + 2]
            if here > least_wall and here >= before and here > after:
                for near in range(b - 1, b + 2):
                    if line[side, near] < 0:
                        line[side, near] = lines
                lines += 1
    return lines
