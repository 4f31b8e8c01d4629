"""Wall cells -> few boxes that cover exactly those cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.building import Box

Rectangles = NDArray[np.int64]
"""(n, 4) half-open rectangles of cells: ix0, iy0, ix1, iy1."""


def rectangles_of(solid: NDArray[np.bool_]) -> Rectangles:
    """Few rectangles whose union is exactly the solid cells (ny, nx); they may overlap.

    Greedy: each cell not covered yet gets the larger of two maximal rectangles around it. Overlap
    saves boxes where ragged walls meet, and each box costs every lidar beam that passes near it.
    """
    from sim import walls_kernels  # numba: only when a raster is to be cut up

    return walls_kernels.greedy_cover(np.ascontiguousarray(solid, dtype=np.bool_))


def boxes_of(solid: NDArray[np.bool_], resolution_m: float, origin_m: tuple[float, float]) -> list[Box]:
    """The same in metres; origin_m is the lower-left corner of cell (0, 0)."""
    half_m = 0.5 * resolution_m
    return [
        Box(
            x_m=origin_m[0] + float(ix0 + ix1) * half_m,
            y_m=origin_m[1] + float(iy0 + iy1) * half_m,
            half_x_m=float(ix1 - ix0) * half_m,
            half_y_m=float(iy1 - iy0) * half_m,
        )
        for ix0, iy0, ix1, iy1 in rectangles_of(solid)
    ]
