"""A submap: a few metres of travel, rigid, in a frame of its own; what scans are matched against."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2
from occmap.scan import Scan

COLUMNS = 8
"""Of a surfel's row, see surfel_kernels."""


@dataclass(frozen=True)
class SubmapConfig:
    """How finely a submap remembers what was seen."""

    cell_m: float = 0.05
    """Side of a cell of the raster that the correlative search scores on."""
    voxel_m: float = 0.06
    """Points within one voxel are averaged into one surfel."""
    spread_m: float = 0.06
    """Standard deviation of the peak that a point leaves on the raster."""
    reach_m: float = 30.0
    """Points farther than this from the robot are not matched."""
    margin_m: float = 5.0
    """How far beyond its reach a submap still has room, for the robot's travel within it."""

    def __post_init__(self) -> None:
        for name in ("cell_m", "voxel_m", "spread_m", "reach_m", "margin_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


class LikelihoodPyramid:
    """A raster of how likely a point is to lie in each cell (0 to 255), and its upper bounds."""

    LEVELS = 7

    def __init__(self, config: SubmapConfig, low_m: tuple[float, float], high_m: tuple[float, float]) -> None:
        from occmap.localization import search_kernels

        self._kernels = search_kernels
        self.cell_m = config.cell_m
        self.origin_m = low_m
        nx = math.ceil((high_m[0] - low_m[0]) / config.cell_m)
        ny = math.ceil((high_m[1] - low_m[1]) / config.cell_m)
        shapes = [(ny, nx)] + [((ny >> k) + 3, (nx >> k) + 3) for k in range(1, self.LEVELS)]
        self.shapes = np.array(shapes, np.int64)
        self.starts = np.concatenate(([0], np.cumsum(self.shapes.prod(axis=1))[:-1]))
        self.buffer = np.zeros(int(self.shapes.prod(axis=1).sum()), np.uint8)
        self._profile = _peak(config.spread_m / config.cell_m)

    def insert(self, points: Points) -> None:
        """Adds points (n, 2) of the submap's frame."""
        self._kernels.stamp(
            self.buffer, self.starts, self.shapes, points, *self.origin_m, 1.0 / self.cell_m, self._profile
        )


def _peak(sigma_cells: float) -> NDArray[np.uint8]:
    """(r, r) a Gaussian of 255 by the distance in cells along both axes, out to two sigma."""
    d = np.arange(math.ceil(2.0 * sigma_cells) + 1)
    return np.round(255.0 * np.exp(-0.5 * (d[:, None] ** 2 + d[None, :] ** 2) / sigma_cells**2)).astype(
        np.uint8
    )


class SurfelMap:
    """Little pieces of wall: averaged points with normals, found by voxel."""

    def __init__(self, config: SubmapConfig, low_m: tuple[float, float], high_m: tuple[float, float]) -> None:
        from occmap.localization import surfel_kernels

        self._kernels = surfel_kernels
        self.origin_m = low_m
        self.voxels_per_m = 1.0 / config.voxel_m
        nx = math.ceil((high_m[0] - low_m[0]) / config.voxel_m) + 1
        ny = math.ceil((high_m[1] - low_m[1]) / config.voxel_m) + 1
        self.index = np.full((ny, nx), -1, np.int32)
        self.rows = np.zeros((1024, COLUMNS))
        self.size = 0

    def insert(self, points: Points, facing: Points) -> None:
        """Averages in points (n, 2) of the submap's frame, and the unit vectors towards who saw them."""
        if self.size + len(points) > len(self.rows):
            self.rows = np.concatenate((self.rows, np.zeros((max(len(self.rows), len(points)), COLUMNS))))
        self.size = self._kernels.insert(
            self.index, self.rows, self.size, points, facing, *self.origin_m, self.voxels_per_m
        )

    def renew_normals(self) -> None:
        self._kernels.renew_normals(self.index, self.rows, self.size, *self.origin_m, self.voxels_per_m)

    def adopt(self, rows: NDArray[np.float64]) -> None:
        """Takes over the finished surfels (n, COLUMNS) of another map of the same frame and voxels."""
        self.rows, self.size = rows, len(rows)
        self._kernels.reindex(self.index, rows, *self.origin_m, self.voxels_per_m)


@dataclass(frozen=True)
class Cloud:
    """Points and the side that each was seen from."""

    points: Points  # (n, 2)
    facing: Points  # (n, 2) unit vectors

    @staticmethod
    def of(scan: Scan, robot_from_lidar: Pose2, reach_m: float) -> Cloud:
        """The hits within reach, in the robot's frame."""
        hit = scan.is_hit & (scan.ranges_m < reach_m)
        bearings, ranges = scan.bearings_rad[hit] + robot_from_lidar.yaw_rad, scan.ranges_m[hit, None]
        away = np.column_stack((np.cos(bearings), np.sin(bearings)))
        return Cloud(away * ranges + np.array(robot_from_lidar.position), -away)

    def moved(self, pose: Pose2) -> Cloud:
        """The same in the left-hand frame of the pose."""
        turn = Pose2(0.0, 0.0, pose.yaw_rad)
        return Cloud(pose.apply(self.points), turn.apply(self.facing))


@dataclass(frozen=True)
class View:
    """A scan that a submap was made of, kept to tell what was seen through."""

    submap_from_lidar: Pose2
    scan: Scan


@dataclass
class Submap:
    """Surfels of a few metres of travel. Its frame is the robot's pose at its first scan."""

    config: SubmapConfig
    previous_from_submap: Pose2
    information: NDArray[np.float64]  # (3, 3) of previous_from_submap, in this submap's frame
    reach_m: float
    scans: int = 0
    cloud: NDArray[np.float64] | None = None  # (n, COLUMNS) surfels, once finished
    centre: tuple[float, float] = (0.0, 0.0)
    views: list[View] = field(default_factory=list)

    def __post_init__(self) -> None:
        half = min(self.reach_m, self.config.reach_m) + self.config.margin_m
        self._surfels: SurfelMap | None = SurfelMap(self.config, (-half, -half), (half, half))
        self._raster: LikelihoodPyramid | None = LikelihoodPyramid(self.config, (-half, -half), (half, half))

    def insert(self, cloud: Cloud, submap_from_robot: Pose2) -> None:
        """Adds one scan."""
        moved = cloud.moved(submap_from_robot)
        self.surfels.insert(moved.points, moved.facing)
        self.raster.insert(moved.points)
        self.scans += 1
        x, y = self.centre
        self.centre = (
            x + (submap_from_robot.x_m - x) / self.scans,
            y + (submap_from_robot.y_m - y) / self.scans,
        )

    def finish(self) -> None:
        """Nothing is inserted from now on: keep the surfels, give up the working memory."""
        self.surfels.renew_normals()
        self.cloud = self.surfels.rows[: self.surfels.size].copy()
        self.release()

    @property
    def views_array(self):
        return np.array(
            [
                [v.submap_from_lidar.x_m, v.submap_from_lidar.y_m, v.submap_from_lidar.yaw_rad]
                for v in self.views
            ]
        )

    @property
    def view_ranges(self):
        n = max(len(v.scan.ranges_m) for v in self.views)
        return np.array(
            [np.where(v.scan.is_hit, v.scan.ranges_m, 0.0) for v in self.views if len(v.scan.ranges_m) == n]
        )

    @property
    def view_bearings(self):
        return self.views[0].scan.bearings_rad

    def release(self) -> None:
        """Give up what can be built again from the cloud."""
        self._surfels = self._raster = None

    @property
    def surfels(self) -> SurfelMap:
        if self._surfels is None:
            assert self.cloud is not None
            self._surfels = SurfelMap(self.config, *self._bounds())
            self._surfels.adopt(self.cloud)
        return self._surfels

    @property
    def raster(self) -> LikelihoodPyramid:
        if self._raster is None:
            assert self.cloud is not None
            self._raster = LikelihoodPyramid(self.config, *self._bounds())
            self._raster.insert(np.ascontiguousarray(self.cloud[:, :2]))
        return self._raster

    def _bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Low and high corner of the cloud, on the voxels' lattice, with room for a search's margin."""
        assert self.cloud is not None
        v = self.config.voxel_m
        low = (np.floor(self.cloud[:, :2].min(axis=0) / v) - 4) * v
        high = (np.ceil(self.cloud[:, :2].max(axis=0) / v) + 4) * v
        return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
