"""The range by which a sensor says that a beam met nothing, where its log does not tell.

Switched to a range of 8 m a SICK laser writes 8.19, at 16 m 16.38, at 32 m 32.76; others write the longest
range they are set to. Taken for hits, such beams are a round wall that goes along with the robot.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from occmap.scan import Scan

SAME_M = 0.005
"""Logs hold centimetres, and a code is always the same to the last digit."""
BELOW_M = 1.0
"""Ranges that are measured thin out: far fewer are the very longest than lie in the metre below."""
LEAST_BEAMS = 1000
"""A code that is rarer does no harm, and fewer beams may be heaped up by chance."""


def no_return_code(scans: Sequence[Scan]) -> float | None:
    """The longest range of the hits in a log, if so many beams share it that it was never measured."""
    hits = np.concatenate([scan.ranges_m[np.isfinite(scan.ranges_m)] for scan in scans] or [np.empty(0)])
    longest = float(hits.max(initial=0.0))
    same = int((hits >= longest - SAME_M).sum())
    below = int((hits >= longest - BELOW_M).sum()) - same
    return longest if same >= LEAST_BEAMS and same > below else None
