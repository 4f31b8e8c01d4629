"""No-returns that are more likely a missed echo than an open view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from occmap.scan import Scan

LONGEST_RUN = 2


def without_missed_returns(scan: Scan) -> Scan:
    """The scan with short runs of no-returns marked as failed beams.

    A pane of glass or a dark leg swallows one beam among many that hit; believed, each such beam
    would free a line straight through the wall. An open view wider than the gap between a few
    beams shows in more of them, if not from here then from nearer by. O(n).
    """
    nothing = np.isinf(scan.ranges_m)
    if not nothing.any() or nothing.all():
        return scan
    n = len(nothing)
    first = int(np.argmin(nothing))  # start on a beam that is no part of a run: runs may wrap around
    turned = np.concatenate((nothing[first:], nothing[:first], [False]))
    edges = np.flatnonzero(np.diff(turned.astype(np.int8)))
    starts, ends = edges[0::2] + 1, edges[1::2] + 1
    short = ends - starts <= LONGEST_RUN
    if not short.any():
        return scan
    ranges_m = scan.ranges_m.copy()
    for start, end in zip(starts[short], ends[short], strict=True):
        ranges_m[(np.arange(start, end) + first) % n] = np.nan
    return replace(scan, ranges_m=ranges_m)
