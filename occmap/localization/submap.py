"""A submap: a few metres of travel, rigid, in a frame of its own; what scans are matched against."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.geometry import Points, Pose2
from occmap.localization.likelihood_pyramid import LikelihoodPyramid
from occmap.localization.surfel_map import BRIDGE_OFF_M, Cloud, Corner, PackedSurfels, SurfelMap
from occmap.localization.surfel_rows import MEAN
from occmap.scan import Scan

ROOM_VOXELS = 4
"""Free around a finished submap."""
FLAT_M = 0.012
"""Hits of a wall are off its line by so much even where noise is averaged out; a front before it by more."""


@dataclass(frozen=True)
class SubmapConfig(Positive):
    """How finely a submap remembers what was seen."""

    cell_m: float = 0.05
    """Side of a cell of the raster that the correlative search scores on."""
    voxel_m: float = 0.06
    """Points within one voxel are averaged into one surfel; smaller than a partition is thick."""
    spread_m: float = 0.06
    """Standard deviation of the peak that a point leaves on the raster."""
    reach_m: float = 60.0
    """Points farther than this from the robot are not matched."""
    margin_m: float = 5.0
    """How far beyond its reach a submap still has room, for the robot's travel within it."""


@dataclass(frozen=True)
class View:
    """One of the scans that a submap was made of, kept to tell what was seen through."""

    submap_from_lidar: Pose2
    bearings_rad: NDArray[np.float32]  # (n,) ascending
    ranges_m: NDArray[np.float32]  # (n,) 0 where a beam met nothing

    @staticmethod
    def of(scan: Scan, submap_from_lidar: Pose2, other: View | None = None) -> View:
        """Make the view of a scan; bearings that another view has as well are shared with it."""
        order = np.argsort(scan.bearings_rad, kind="stable")
        ranges = np.where(scan.is_hit, scan.ranges_m, 0.0)[order].astype(np.float32)
        bearings = scan.bearings_rad[order].astype(np.float32)
        if other is not None and np.array_equal(bearings, other.bearings_rad):
            bearings = other.bearings_rad
        return View(submap_from_lidar, bearings, ranges)


@dataclass
class Submap:
    """Surfels of a few metres of travel. Its frame is the robot's pose at its first scan.

    It grows until it is finished; then `cloud` holds all of it, and surfels and raster are built from
    that when they are asked for.
    """

    config: SubmapConfig
    previous_from_submap: Pose2
    information: NDArray[np.float64]  # (3, 3) of previous_from_submap, in this submap's frame
    reach_m: float
    scans: int = 0
    cloud: PackedSurfels | None = None  # all surfels, once finished
    centre: tuple[float, float] = (0.0, 0.0)  # mean of the robot's positions
    views: list[View] = field(default_factory=list)
    is_after_gap: bool = False  # nothing was tracked from the previous one to this
    _surfels: SurfelMap | None = None
    _raster: LikelihoodPyramid | None = None
    _unstamped: list[Cloud] = field(default_factory=list)  # not in the raster yet: it is seldom asked for

    def insert(self, cloud: Cloud, submap_from_robot: Pose2) -> None:
        """Adds one scan, a cloud in the robot's frame."""
        moved = cloud.moved(submap_from_robot)
        self.surfels.insert(moved)
        self._unstamped.append(moved)
        self.scans += 1
        (x, y), (new_x, new_y) = self.centre, submap_from_robot.position
        self.centre = x + (new_x - x) / self.scans, y + (new_y - y) / self.scans

    def see_better(self, cloud: Cloud, looks: int) -> None:
        """Replace what was seen from the origin by the mean of so many looks from there.

        All looks went along the same beams. A wall that they met here and there is filled in between: by
        the hits alone it would be a row of posts, which holds back the robot that turns before it.
        """
        self.release()
        walls = cloud.walls(max(BRIDGE_OFF_M / math.sqrt(looks), FLAT_M))
        for _ in range(looks):
            self.surfels.insert(walls)
        self._unstamped.append(cloud)

    def finish(self) -> None:
        """Keep what lasted of the surfels, give up the working memory: nothing is inserted from now on.

        What more of its views looked through than met was somebody who walked by.
        """
        rows = self.surfels.finished_rows()
        met, passed = self.judge(rows[:, MEAN].astype(np.float64))
        self.cloud = PackedSurfels.of(rows[passed <= met])
        self.release()

    def judge(self, points: Points) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(n,) how many views met each of the points (n, 2) of this frame, and how many looked through it."""
        from occmap.localization import visibility_kernels as kernels

        met, passed = np.zeros(len(points), np.int64), np.zeros(len(points), np.int64)
        for view in self.views:
            lidar = view.submap_from_lidar
            kernels.look(
                points, lidar.x_m, lidar.y_m, lidar.yaw_rad, view.bearings_rad, view.ranges_m, met, passed
            )
        return met, passed

    def release(self) -> None:
        """Give up what can be built again from the cloud."""
        self._surfels = self._raster = None
        self._unstamped.clear()

    @property
    def rows(self) -> NDArray[np.float64]:
        """(n, COLUMNS) the surfels so far; normals may be behind while it grows."""
        return self.surfels.known if self.cloud is None else self.cloud.rows.astype(np.float64)

    @property
    def surfels(self) -> SurfelMap:
        """Its surfels, for the fine match."""
        if self._surfels is None:
            self._surfels = SurfelMap(self.config.voxel_m, *self._bounds())
            if self.cloud is not None:
                self._surfels.adopt(self.cloud.rows)
        return self._surfels

    @property
    def raster(self) -> LikelihoodPyramid:
        """Where points are likely to lie, for the search."""
        if self._raster is None:
            self._raster = LikelihoodPyramid(self.config.cell_m, self.config.spread_m, *self._bounds())
            if self.cloud is not None:
                self._raster.insert(self.cloud.means.astype(np.float64))
        for cloud in self._unstamped:
            self._raster.insert(cloud.walls().points)
        self._unstamped.clear()
        return self._raster

    def _bounds(self) -> tuple[Corner, Corner]:
        """Low and high corner: of all within reach while it grows, of the cloud when it is finished.

        On the same voxels: in others, two surfels would fall into one, and one of them be lost.
        """
        half, voxel_m = min(self.reach_m, self.config.reach_m) + self.config.margin_m, self.config.voxel_m
        if self.cloud is None or len(self.cloud) == 0:
            return (-half, -half), (half, half)
        low, high = self.cloud.means.min(axis=0), self.cloud.means.max(axis=0) + ROOM_VOXELS * voxel_m
        x, y = (np.floor((low + half) / voxel_m) - ROOM_VOXELS) * voxel_m - half
        return (float(x), float(y)), (float(high[0]), float(high[1]))


def share_seen_through(submap: Submap, points: Points) -> float:
    """Share looked through of the points (n, 2) of a submap's frame that its views can judge."""
    met, passed = submap.judge(points)
    through = int(np.count_nonzero((passed > 0) & (met == 0)))
    return through / max(1, through + int(np.count_nonzero(met)))
