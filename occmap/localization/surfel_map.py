"""Little pieces of wall: averaged points with normals, found by voxel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2
from occmap.localization.surfel_rows import COLUMNS, MEAN
from occmap.scan import Scan

Corner = tuple[float, float]

FIRST_ROWS = 1024
"""Room for so many surfels at first, and for twice as many whenever it runs short."""
BRIDGE_SPACING_M = 0.08
"""Between the points that stand for a wall."""
BRIDGE_M = 2.0
"""Hits farther apart than this say nothing about what is between them."""
BRIDGE_OFF_M = 0.04
"""Three hits are in line if the third is off the line of the other two by less: range noise."""


@dataclass(frozen=True)
class Cloud:
    """Points, and the side that each was seen from."""

    points: Points  # (n, 2)
    facing: Points  # (n, 2) unit vectors
    beams: NDArray[np.int64] | None = None  # (n,) ascending; None: points that are no neighbours

    @staticmethod
    def of(scan: Scan, robot_from_lidar: Pose2, reach_m: float) -> Cloud:
        """The hits within reach, in the robot's frame."""
        from occmap.localization import cloud_kernels

        mount = robot_from_lidar.numbers()
        most_m = min(scan.max_range_m, reach_m)
        return Cloud(
            *cloud_kernels.hits(scan.bearings_rad, scan.ranges_m, scan.least_range_m, most_m, *mount)
        )

    def moved(self, a_from_b: Pose2) -> Cloud:
        """The same cloud of frame b in frame a."""
        turn = Pose2(0.0, 0.0, a_from_b.yaw_rad)
        return Cloud(a_from_b.apply(self.points), turn.apply(self.facing), self.beams)

    def spaced(self, spacing_m: float) -> Cloud:
        """The points at least so far from the last one kept, in order."""
        from occmap.localization import cloud_kernels

        kept = cloud_kernels.spaced(self.points, spacing_m)
        return Cloud(self.points[kept], self.facing[kept])

    def walls(self, off_m: float = BRIDGE_OFF_M) -> Cloud:
        """The same points, and more of them where walls are seen to run between two, straight to off_m."""
        from occmap.localization import cloud_kernels

        if self.beams is None:
            return self
        return Cloud(
            *cloud_kernels.bridged(self.points, self.facing, self.beams, BRIDGE_SPACING_M, BRIDGE_M, off_m)
        )


@dataclass(frozen=True, eq=False)
class PackedSurfels:
    """Surfels that nothing is added to any more, in 20 bytes each: a building has millions."""

    means: NDArray[np.float32]  # (n, 2) in metres
    others: NDArray[np.float16]  # (n, COLUMNS - 2): directions to half a milliradian, counts to 2048 exactly

    @staticmethod
    def of(rows: NDArray[np.float32]) -> PackedSurfels:
        """Pack rows (n, COLUMNS)."""
        others = np.minimum(rows[:, MEAN.stop :], np.finfo(np.float16).max)
        return PackedSurfels(rows[:, MEAN].copy(), others.astype(np.float16))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def rows(self) -> NDArray[np.float32]:
        """(n, COLUMNS) the rows as they were, but for rounding."""
        return np.hstack((self.means, self.others), dtype=np.float32)


class SurfelMap:
    """Surfels of a rectangle, in rows (size, COLUMNS) found through a voxel index."""

    def __init__(self, voxel_m: float, low_m: Corner, high_m: Corner) -> None:
        self.origin_m = low_m
        self.voxels_per_m = 1.0 / voxel_m
        nx = math.ceil((high_m[0] - low_m[0]) / voxel_m) + 1
        ny = math.ceil((high_m[1] - low_m[1]) / voxel_m) + 1
        self.index = np.full((ny, nx), -1, np.int32)
        self.rows: NDArray[np.float64] = np.zeros((FIRST_ROWS, COLUMNS))
        self.size = 0

    def insert(self, cloud: Cloud) -> None:
        """Averages in a cloud of the map's frame."""
        from occmap.localization import surfel_kernels

        n = len(cloud.points)
        if self.size + n > len(self.rows):
            self.rows = np.concatenate((self.rows, np.zeros((max(len(self.rows), n), COLUMNS))))
        self.size = surfel_kernels.insert(
            self.index, self.rows, self.size, cloud.points, cloud.facing, *self.origin_m, self.voxels_per_m
        )

    @property
    def known(self) -> NDArray[np.float64]:
        """(n, COLUMNS) view of the surfels so far."""
        return self.rows[: self.size]

    def finished_rows(self) -> NDArray[np.float32]:
        """(n, COLUMNS) a compact copy of the surfels, every normal from all that is known."""
        from occmap.localization import surfel_kernels

        surfel_kernels.renew_normals(self.index, self.rows, self.size, *self.origin_m, self.voxels_per_m)
        return self.rows[: self.size].astype(np.float32)

    def adopt(self, rows: NDArray[np.float32]) -> None:
        """Takes over the surfels (n, COLUMNS) of another map of the same frame and voxels."""
        from occmap.localization import surfel_kernels

        self.rows, self.size = rows.astype(np.float64), len(rows)
        surfel_kernels.reindex(self.index, self.rows, *self.origin_m, self.voxels_per_m)
