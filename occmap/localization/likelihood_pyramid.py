"""A raster of where points are likely to lie, with upper bounds for branch and bound."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points

Corner = tuple[float, float]

LEVELS = 7
"""The top bounds 64 x 64 cells at once: larger blocks bound nothing in a building."""
HIGHEST = 255.0
"""What the raster holds where a point was seen: a likelihood of 1."""


class LikelihoodPyramid:
    """Likelihood, 0 to HIGHEST, of a point in each cell, and its upper bounds (see search_kernels)."""

    def __init__(self, cell_m: float, spread_m: float, low_m: Corner, high_m: Corner) -> None:
        self.cell_m = cell_m
        self.origin_m = low_m
        nx = math.ceil((high_m[0] - low_m[0]) / cell_m)
        ny = math.ceil((high_m[1] - low_m[1]) / cell_m)
        shapes = [(ny, nx)] + [((ny >> k) + 3, (nx >> k) + 3) for k in range(1, LEVELS)]
        self.shapes = np.array(shapes, np.int64)
        self.starts = np.concatenate(([0], np.cumsum(self.shapes.prod(axis=1))[:-1]))
        self.buffer = np.zeros(int(self.shapes.prod(axis=1).sum()), np.uint8)
        self._peak = peak(spread_m / cell_m)

    def insert(self, points: Points) -> None:
        """Adds points (n, 2) of the raster's frame."""
        from occmap.localization import search_kernels

        search_kernels.stamp(
            self.buffer, self.starts, self.shapes, points, *self.origin_m, 1.0 / self.cell_m, self._peak
        )


def top_blocks(half_cells: int) -> tuple[int, int]:
    """Level to begin a search +-half_cells wide at, and how many of its blocks lie side by side."""
    width = 2 * half_cells + 1
    top = min(LEVELS - 1, width.bit_length() - 1)
    return top, ((width - 1) >> top) + 1


def peak(sigma_cells: float) -> NDArray[np.uint8]:
    """(r, r) mark of a point, by the distance in cells along both axes: a Gaussian out to two sigma."""
    d = np.arange(math.ceil(2.0 * sigma_cells) + 1)
    gaussian = np.exp(-0.5 * (d[:, None] ** 2 + d[None, :] ** 2) / sigma_cells**2)
    return np.round(HIGHEST * gaussian).astype(np.uint8)
