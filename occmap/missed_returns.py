"""No-returns that are more likely a missed echo than an open view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from occmap.scan import Scan

LONGEST_RUN = 2


def without_missed_returns(scan: Scan) -> Scan:
    """The scan with short runs of no-returns marked as failed beams.

    A pane of glass or a dark leg swallows one beam among many that hit; believed, each such beam
    would free a line straight through the wall. An open view wider than the gap between a few
    beams shows in more of them, if not from here then from nearer by. The first beam follows the
    last. O(n).
    """
    return replace(scan, ranges_m=forget_short_runs(scan.ranges_m, LONGEST_RUN))


@njit(cache=True)
def forget_short_runs(ranges_m: NDArray[np.float64], longest: int) -> NDArray[np.float64]:
    """(n,) the ranges with every run of at most `longest` inf between two that are not made nan."""
    n = ranges_m.shape[0]
    out = ranges_m.copy()
    for start in range(n):
        if not np.isinf(ranges_m[start]) or np.isinf(ranges_m[start - 1]):
            continue
        length = 1
        while length <= longest and np.isinf(ranges_m[(start + length) % n]):
            length += 1
        if length <= longest:
            for k in range(length):
                out[(start + k) % n] = np.nan
    return out
