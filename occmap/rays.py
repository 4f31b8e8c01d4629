"""Cells crossed by a beam: Bresenham's line in integers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.kernel import part


@part
def ray_cells(ix0: int, iy0: int, ix1: int, iy1: int) -> NDArray[np.int64]:
    """(n, 2) cells from (ix0, iy0) to (ix1, iy1), both included; n = 1 + the longer of |dx|, |dy|.

    Bresenham (1965). The longer axis advances at every step, the shorter one when twice the error
    falls below the longer extent. The line back visits other cells where it meets a corner.
    """
    dx, dy = abs(ix1 - ix0), abs(iy1 - iy0)
    sx, sy = (1 if ix1 > ix0 else -1), (1 if iy1 > iy0 else -1)
    steep = dy > dx
    long, short = (dy, dx) if steep else (dx, dy)
    cells = np.empty((long + 1, 2), np.int64)
    ix, iy, error = ix0, iy0, long - short
    for k in range(long + 1):
        cells[k, 0], cells[k, 1] = ix, iy
        aside = 2 * error < long
        error += (long if aside else 0) - short
        if steep or aside:
            iy += sy
        if not steep or aside:
            ix += sx
    return cells
