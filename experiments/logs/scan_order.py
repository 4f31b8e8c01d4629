"""In which order the scans of a log were taken: that of their stamps, or that of the file.

Some loggers stamp a message when they get round to it. Sorted by such stamps the robot jumps back and
forth (by up to 54 degrees in the log of the Intel Research Lab), while in the file it drives smoothly.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from occmap.geometry import wrap_angle
from occmap.scan import Observation

CLEARLY_LESS = 0.95
"""The stamps are believed unless less than this part of the motion is left in the file's order."""
MOST_M = 1.0
"""Ranges that differ by more than this look at different things, and how different says nothing."""


def in_driven_order(in_file: Sequence[Observation]) -> Sequence[Observation]:
    """Sorted by stamp, or as they came if the robot then moves clearly less from one to the next."""
    by_stamp = sorted(in_file, key=lambda seen: seen.time_s)
    moves = any(seen.odom_from_robot != in_file[0].odom_from_robot for seen in in_file)
    restlessness = travelled if moves else changed
    return in_file if restlessness(in_file) < CLEARLY_LESS * restlessness(by_stamp) else by_stamp


def travelled(stream: Sequence[Observation]) -> float:
    """Metres and radians of odometry from scan to scan, summed up."""
    poses = [seen.odom_from_robot for seen in stream]
    return sum(a.distance_to(b) + abs(wrap_angle(b.yaw_rad - a.yaw_rad)) for a, b in pairwise(poses))


def changed(stream: Sequence[Observation]) -> float:
    """How unlike neighbouring scans look (mean difference of their ranges, m), summed up."""
    scans = [seen.scan for seen in stream]
    ranges = [np.nan_to_num(scan.ranges_m, nan=0.0, posinf=scan.max_range_m) for scan in scans]
    pairs = [(a, b) for a, b in pairwise(ranges) if a.shape == b.shape]
    return float(sum(np.minimum(np.abs(a - b), MOST_M).mean() for a, b in pairs))
