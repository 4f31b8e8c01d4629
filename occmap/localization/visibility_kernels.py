"""Kernel of the loop check: points of one submap that the other has looked straight through."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def count(points, lidars, ranges, bearings):
    """(points met, points looked through) by scans taken at lidars (v, 3) in the points' frame.

    ranges (v, n) with 0 where a beam says nothing, bearings (n,) ascending. A point is met if any
    scan ended on it, looked through if none did and one went at least 0.4 m farther on both sides of
    it. O(points * scans).
    """
    met = through = 0
    n = bearings.shape[0]
    step = (bearings[n - 1] - bearings[0]) / (n - 1)
    for p in range(points.shape[0]):
        on = beyond = False
        for v in range(lidars.shape[0]):
            dx, dy = points[p, 0] - lidars[v, 0], points[p, 1] - lidars[v, 1]
            distance = np.hypot(dx, dy)
            turn = np.arctan2(dy, dx) - lidars[v, 2] - bearings[0]
            turn -= 2.0 * np.pi * np.floor((turn + 0.5 * step) / (2.0 * np.pi))
            beam = int(np.floor(turn / step + 0.5))
            if beam < 1 or beam > n - 2:
                continue
            near, far = np.inf, 0.0
            for b in range(beam - 1, beam + 2):
                r = ranges[v, b]
                if r <= 0.0:
                    near = 0.0
                else:
                    near, far = min(near, r), max(far, r)
                    on = on or abs(r - distance) < 0.2
            beyond = beyond or near > distance + 0.4
        if on:
            met += 1
        elif beyond:
            through += 1
    return met, through
