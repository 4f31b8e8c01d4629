"""Kernel of what was once in reach: it follows corrections of the map."""

from __future__ import annotations

from occmap.kernel import kernel


@kernel
def carry(reached, carried, cos, sin, x0, y0):
    """Mark in carried (ny, nx) where the marked cells of reached come to lie. O(cells of reached).

    Both in cells: the centre of cell (ix, iy) comes to (x0, y0) and (ix, iy) turned by an angle.
    """
    ny, nx = carried.shape
    for iy in range(reached.shape[0]):
        for ix in range(reached.shape[1]):
            if reached[iy, ix]:
                x, y = x0 + cos * ix - sin * iy, y0 + sin * ix + cos * iy
                if 0.0 <= x < nx and 0.0 <= y < ny:
                    carried[int(y), int(x)] = 1
