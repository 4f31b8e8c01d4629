"""Scans of a few beams, and what a grid makes of them, for tests."""

from __future__ import annotations

import numpy as np

from occmap.grid import OccupancyGrid
from occmap.scan import Scan

AHEAD = np.zeros(1)
"""The bearing of a single beam straight ahead."""


def beams(bearings, ranges, max_range_m: float = 12.0, min_range_m: float = 0.05) -> Scan:
    return Scan(np.asarray(bearings, float), np.asarray(ranges, float), max_range_m, min_range_m)


def at(grid: OccupancyGrid, x_m: float, y_m: float) -> float:
    ix, iy = grid.frame.cell_at(x_m, y_m)
    return float(grid.log_odds[iy, ix])
