"""Which solids could shorten a scan."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.solids import Floats, SolidArrays

BINS = 512
_WIDTH_RAD = 2.0 * math.pi / BINS


def in_front(
    solids: SolidArrays, x_m: float, y_m: float, angles_rad: Floats, ranges_m: Floats
) -> NDArray[np.bool_]:
    """(n,) whether a solid comes as near as the longest of the beams that point at it.

    Beams start at a place and have angles and ranges (k,). A solid is pointed at by the beams between the
    tangents of its bounding circle. Beams are sorted into bins of direction, and the longest range in any run
    of bins is read from a table of runs of powers of two (a sparse table): O(n + k + BINS log BINS).
    """
    dx, dy = solids.center_m[:, 0] - x_m, solids.center_m[:, 1] - y_m
    radius = np.hypot(solids.half_m[:, 0], solids.half_m[:, 1]) + solids.radius_m
    distance = np.hypot(dx, dy)
    with np.errstate(divide="ignore"):
        spread = np.arcsin(np.minimum(radius / distance, 1.0))
    spread[distance <= radius] = math.pi  # all around
    middle = np.arctan2(dy, dx)
    first = np.floor((middle - spread) / _WIDTH_RAD).astype(np.int64)
    last = np.floor((middle + spread) / _WIDTH_RAD).astype(np.int64)
    count = np.minimum(last - first + 1, BINS)
    return solids.distance_m(x_m, y_m) <= _longest(angles_rad, ranges_m, first, count)


def _longest(
    angles_rad: Floats, ranges_m: Floats, first: NDArray[np.int64], count: NDArray[np.int64]
) -> Floats:
    """(n,) the longest range in runs of `count` bins from `first` on; -inf where no beam points."""
    bins = np.floor(angles_rad / _WIDTH_RAD).astype(np.int64) % BINS
    table = np.full((BINS.bit_length(), BINS), -np.inf)
    np.maximum.at(table[0], bins, ranges_m)
    for level in range(1, len(table)):
        table[level] = np.maximum(table[level - 1], np.roll(table[level - 1], -(1 << (level - 1))))
    level = np.frexp(count)[1] - 1  # the largest power of two in the run
    end = first + count - (1 << level)
    return np.maximum(table[level, first % BINS], table[level, end % BINS])
