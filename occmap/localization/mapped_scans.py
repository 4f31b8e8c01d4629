"""The scans that are in the map, and where each was taken; packed, for a day's drive must fit into memory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.growing import GrowingArray
from occmap.localization.box import Box
from occmap.localization.tracked import Tracked
from occmap.scan import Scan

SWEEP_M_PER_M2 = 2.0
"""Votes are collected in a window around the beams: to sweep a square metre costs as much as so long a beam.
Outdoors, where few beams reach far, that is most of it."""

NUMBERS = 8 + Tracked.NUMBERS
"""Kept of each scan besides its beams."""

STEPS = 65_534
"""A range is kept in 16 bits, as so many steps to the lidar's reach: they are 0.2 mm of 12 m."""
NOTHING_MET, FAILED = STEPS, STEPS + 1


@dataclass(frozen=True)
class MappedScan:
    """A scan that is in the map, and where it was taken."""

    scan: Scan
    robot_from_lidar: Pose2
    tracked: Tracked
    reach_m: float
    """No vote of it lies farther from the lidar."""
    effort_m: float
    """What it costs to map it, in metres of beams."""

    @staticmethod
    def of(scan: Scan, robot_from_lidar: Pose2, tracked: Tracked) -> MappedScan:
        """A scan taken where the tracker has the robot; its reach and effort are told from its beams."""
        lengths_m = np.clip(scan.ranges_m[~np.isnan(scan.ranges_m)], 0.0, scan.max_range_m)
        reach_m, beams_m = float(lengths_m.max(initial=0.0)), float(lengths_m.sum())
        mapped = MappedScan(scan, robot_from_lidar, tracked, reach_m, beams_m)
        return replace(mapped, effort_m=beams_m + SWEEP_M_PER_M2 * mapped.box(Pose2.identity()).area_m2)

    def map_from_lidar(self, map_from_submap: list[Pose2]) -> Pose2:
        """Where it was taken, given where the submaps lie."""
        return self.tracked.in_map(map_from_submap) @ self.robot_from_lidar

    def box(self, map_from_lidar: Pose2) -> Box:
        """Box of what it votes on: up to its hits, or all round if some of its beams met nothing."""
        if np.isinf(self.scan.ranges_m).any():
            return Box.around(*map_from_lidar.position, self.reach_m)
        hits = map_from_lidar.apply(self.scan.hits_in_lidar())
        places = np.vstack((hits, map_from_lidar.position))
        return Box(*places.min(axis=0).tolist(), *places.max(axis=0).tolist())


class MappedScans:
    """Scans in the order they were mapped. What is read back is the scan as it is kept: see packed_ranges.

    A scan of 360 beams takes 1 kB, and no Python object of its own but an array.
    """

    def __init__(self) -> None:
        self._ranges: list[NDArray[np.uint16]] = []  # of each scan
        self._bearings: list[NDArray[np.float32]] = []  # most lidars have the same in every scan
        self._numbers = GrowingArray((NUMBERS,))
        self._last_read: tuple[int, NDArray[np.float64]] = -1, np.empty(0)  # which bearings, and these

    def __len__(self) -> int:
        return len(self._ranges)

    def append(self, mapped: MappedScan) -> None:
        """Keep one more scan."""
        scan, mount = mapped.scan, mapped.robot_from_lidar
        bearings = scan.bearings_rad.astype(np.float32)
        if not self._bearings or not np.array_equal(bearings, self._bearings[-1]):
            self._bearings.append(bearings)
        self._ranges.append(packed_ranges(scan))
        self._numbers.append(
            (
                *(len(self._bearings) - 1, scan.min_range_m, scan.max_range_m),
                *(mount.x_m, mount.y_m, mount.yaw_rad, *mapped.tracked.numbers()),
                *(mapped.reach_m, mapped.effort_m),
            )
        )

    def __getitem__(self, k: int) -> MappedScan:
        which, min_range_m, max_range_m, *mount, reach_m, effort_m = self._numbers.rows[k].tolist()
        ranges_m = unpacked_ranges(self._ranges[k], max_range_m)
        scan = Scan(self._bearings_rad(int(which)), ranges_m, max_range_m, min_range_m)
        return MappedScan(scan, Pose2(*mount[:3]), Tracked.of_numbers(mount[3:]), reach_m, effort_m)

    def _bearings_rad(self, which: int) -> NDArray[np.float64]:
        """Bearings of a scan: one array for all scans that have the same."""
        if self._last_read[0] != which:
            self._last_read = which, self._bearings[which].astype(np.float64)
        return self._last_read[1]


def packed_ranges(scan: Scan) -> NDArray[np.uint16]:
    """(n,) ranges to the nearest step; a hit stays a hit."""
    step_m = scan.max_range_m / STEPS
    codes = np.full(len(scan.ranges_m), FAILED, np.uint16)
    codes[scan.ranges_m >= scan.max_range_m] = NOTHING_MET
    hit = scan.is_hit
    steps = np.round(scan.ranges_m[hit] / step_m)
    codes[hit] = np.clip(steps, math.ceil(scan.least_range_m / step_m), STEPS - 1)
    return codes


def unpacked_ranges(codes: NDArray[np.uint16], max_range_m: float) -> NDArray[np.float64]:
    """(n,) ranges; inf where nothing was met, nan where a beam failed or its range says nothing."""
    ranges_m = codes.astype(np.float64) * (max_range_m / STEPS)
    ranges_m[codes == NOTHING_MET] = np.inf
    ranges_m[codes == FAILED] = np.nan
    return ranges_m
