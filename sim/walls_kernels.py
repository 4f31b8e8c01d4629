"""The cutting of a raster into rectangles, as kernels."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def extent_along_row(solid, covered, ix, iy):
    """The widest stretch of row iy through ix, grown upwards while it stays solid: (ix0, iy0, ix1, iy1)."""
    ix0, ix1 = ix, ix + 1
    while ix0 > 0 and solid[iy, ix0 - 1] and not covered[iy, ix0 - 1]:
        ix0 -= 1
    while ix1 < solid.shape[1] and solid[iy, ix1]:
        ix1 += 1
    iy1 = iy + 1
    while iy1 < solid.shape[0] and solid[iy1, ix0:ix1].all():
        iy1 += 1
    return ix0, iy, ix1, iy1


@njit(cache=True)
def extent_along_column(solid, ix, iy):
    """The tallest stretch of column ix upwards from iy, grown to both sides while it stays solid."""
    iy1 = iy + 1
    while iy1 < solid.shape[0] and solid[iy1, ix]:
        iy1 += 1
    ix0, ix1 = ix, ix + 1
    while ix0 > 0 and solid[iy:iy1, ix0 - 1].all():
        ix0 -= 1
    while ix1 < solid.shape[1] and solid[iy:iy1, ix1].all():
        ix1 += 1
    return ix0, iy, ix1, iy1


@njit(cache=True)
def uncovered(covered, extent):
    """How many cells of a rectangle are not covered yet."""
    ix0, iy0, ix1, iy1 = extent
    count = 0
    for iy in range(iy0, iy1):
        for ix in range(ix0, ix1):
            count += not covered[iy, ix]
    return count


@njit(cache=True)
def greedy_cover(solid):
    """(n, 4) rectangles ix0, iy0, ix1, iy1 whose union is solid (ny, nx) bool.

    Cells are visited row by row; O(cells + rectangles * their size).
    """
    covered = np.zeros_like(solid)
    found = [(0, 0, 0, 0) for _ in range(0)]
    for iy in range(solid.shape[0]):
        for ix in range(solid.shape[1]):
            if not solid[iy, ix] or covered[iy, ix]:
                continue
            wide = extent_along_row(solid, covered, ix, iy)
            tall = extent_along_column(solid, ix, iy)
            chosen = wide if uncovered(covered, wide) >= uncovered(covered, tall) else tall
            covered[chosen[1] : chosen[3], chosen[0] : chosen[2]] = True
            found.append(chosen)
    rectangles = np.empty((len(found), 4), np.int64)
    for k, (ix0, iy0, ix1, iy1) in enumerate(found):
        rectangles[k] = ix0, iy0, ix1, iy1
    return rectangles
