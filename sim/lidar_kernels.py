"""Kernels of the lidar: what its errors make of exact ranges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

OPTIONS: dict[str, Any] = {"cache": True, "no_cfunc_wrapper": True}
"""Those of occmap's kernels: what numba compiles for those then serves this one, too."""


@njit(**OPTIONS)
def spoil(exact_m, normal, short, miss, dropout, levels, min_range_m, max_range_m):
    """(n,) measured ranges from exact ones and from the chances drawn for every beam (n,). O(n).

    `levels` (6,) are those of LidarNoiseConfig, in its order. At or beyond max_range_m a range is inf, that
    of a failed beam nan.
    """
    sigma_m, sigma_share, quantum_m, dropout_rate, short_rate, miss_rate = levels
    measured_m = np.empty(exact_m.shape[0])
    for k in range(exact_m.shape[0]):
        reach_m = min(exact_m[k], max_range_m)
        value = reach_m + (sigma_m + sigma_share * reach_m) * normal[k]
        if exact_m[k] > max_range_m:
            value = np.inf
        if short[k] < short_rate:  # below the rate, chance is uniform still
            value = min_range_m + short[k] / short_rate * max(reach_m - min_range_m, 0.0)
        if miss[k] < miss_rate:
            value = np.inf
        if quantum_m > 0.0 and value < np.inf:
            value = np.rint(value / quantum_m) * quantum_m
        value = max(value, 0.0)
        if value >= max_range_m:
            value = np.inf
        measured_m[k] = math.nan if dropout[k] < dropout_rate else value
    return measured_m
