"""Many scans from one place, averaged beam by beam: a scan with a fraction of the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.scan import Scan

OUTLIER_M = 0.15
"""A range farther than this from the beam's median is no measurement of the same thing."""
LEAST_SHARE = 0.3
"""Of the looks, in which a beam must have met something."""


class LongLook:
    """Collects scans of one lidar that stands still."""

    def __init__(self, scan: Scan, robot_from_lidar: Pose2) -> None:
        self.robot_from_lidar = robot_from_lidar
        self._scan = scan
        self._ranges_m: list[NDArray[np.float64]] = []
        self.add(scan)

    def __len__(self) -> int:
        return len(self._ranges_m)

    def add(self, scan: Scan) -> bool:
        """Take in one more scan; False if its beams are others."""
        if not np.array_equal(scan.bearings_rad, self._scan.bearings_rad):
            return False
        self._ranges_m.append(np.where(scan.is_hit, scan.ranges_m, np.nan))
        return True

    def mean(self) -> Scan:
        """The scan that all are samples of. Beams that met little say nothing (nan)."""
        ranges = np.array(self._ranges_m)
        middle = np.full(ranges.shape[1], np.nan)
        hit = np.isfinite(ranges).any(axis=0)
        middle[hit] = np.nanmedian(ranges[:, hit], axis=0)
        near = np.abs(ranges - middle) <= OUTLIER_M
        count = np.count_nonzero(near, axis=0)
        mean = np.where(near, ranges, 0.0).sum(axis=0) / np.maximum(count, 1)
        seen = count >= max(1.0, LEAST_SHARE * len(ranges))
        return replace(self._scan, ranges_m=np.where(seen, mean, np.nan))
