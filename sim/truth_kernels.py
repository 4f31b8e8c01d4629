"""Which cells see a place: the one costly question of the truth, as a kernel."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def sees(free, x0, y0, x1, y1):
    """Whether all cells of Bresenham's line (1965, all-octant integer form) are free. O(length).

    Walls that touch at a corner are closed there: a beam does not pass between them.
    """
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x1 > x0 else -1
    sy = 1 if y1 > y0 else -1
    error = dx - dy
    while True:
        if not free[y0, x0]:
            return False
        if x0 == x1 and y0 == y1:
            return True
        twice = 2 * error
        if -dy < twice < dx and not (free[y0, x0 + sx] or free[y0 + sy, x0]):
            return False
        if twice > -dy:
            error -= dy
            x0 += sx
        if twice < dx:
            error += dx
            y0 += sy


@njit(cache=True)
def place_in_sight(free, places, stride, reach, ix, iy, ring0, ring1):
    """Index of a place (row-major) that the cell sees, looking outwards ring by ring; -1 if there is none."""
    ny, nx = places.shape
    jx, jy = (ix + stride // 2) // stride, (iy + stride // 2) // stride
    for ring in range(ring0, ring1):
        for ky in range(max(0, jy - ring), min(ny, jy + ring + 1)):
            step = 1 if abs(ky - jy) == ring or ring == 0 else 2 * ring
            for kx in range(jx - ring, jx + ring + 1, step):
                if kx < 0 or kx >= nx or not places[ky, kx]:
                    continue
                px, py = kx * stride, ky * stride
                if (px - ix) ** 2 + (py - iy) ** 2 <= reach and sees(free, ix, iy, px, py):
                    return ky * nx + kx
    return -1


@njit(cache=True)
def cells_in_sight(free, candidate, places, stride, start_x, start_y, reach):
    """(ny, nx) candidate cells that see the start or a place.

    free, candidate: (ny, nx) bool. places: bool, place (kx, ky) stands on cell (kx, ky) * stride.
    reach: the range squared, in cells. Nearly all cells see a place next to them; the others first
    try the place that their neighbour saw, and only then all places outwards up to the range:
    O(cells + hidden cells * places in range).
    """
    ny, nx = free.shape
    rings = int(np.sqrt(reach)) // stride + 2
    columns = places.shape[1]
    seen_by = np.full((ny, nx), -1, np.int32)
    seen = np.zeros((ny, nx), np.bool_)
    for iy in range(ny):
        for ix in range(nx):
            if not candidate[iy, ix]:
                continue
            found = place_in_sight(free, places, stride, reach, ix, iy, 0, 2)
            for hint in (seen_by[iy, max(ix - 1, 0)], seen_by[max(iy - 1, 0), ix]):
                if found < 0 and hint >= 0:
                    px, py = hint % columns * stride, hint // columns * stride
                    if (px - ix) ** 2 + (py - iy) ** 2 <= reach and sees(free, ix, iy, px, py):
                        found = hint
            if found < 0:
                found = place_in_sight(free, places, stride, reach, ix, iy, 2, rings)
            seen_by[iy, ix] = found
            near_start = (start_x - ix) ** 2 + (start_y - iy) ** 2 <= reach
            seen[iy, ix] = found >= 0 or (near_start and sees(free, ix, iy, start_x, start_y))
    return seen
