"""Who may say where a recorded robot was, live and in hindsight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization import Estimate, OdometryLocalizer
from occmap.mapper import Mapper
from occmap.scan import Observation, Scan

PoseSource = Literal["slam", "odometry"]


class ReplayLocalizer(Protocol):
    """A localizer that, once all has been seen, can say where it was all along, and draw the map of it."""

    def update(self, seen: Observation) -> Estimate: ...

    def finish(self) -> None:
        """Nothing more will be seen: settle."""
        ...

    def trajectory(self) -> Sequence[tuple[float, Pose2]]:
        """(time, map_from_robot) of every update so far, as it is known now."""
        ...

    def map(self) -> OccupancyGrid:
        """The map that the scans make at these poses."""
        ...


class RememberedOdometry:
    """Believes the wheels, and remembers what they said and what was seen."""

    def __init__(self, grid: GridConfig) -> None:
        self._grid = grid
        self._odometry, self._filter = OdometryLocalizer(), MotionFilter()
        self._track: list[tuple[float, Pose2]] = []
        self._mapped: list[tuple[Scan, Pose2]] = []  # with map_from_lidar

    def update(self, seen: Observation) -> Estimate:
        estimate = self._odometry.update(seen)
        self._track.append((seen.time_s, estimate.map_from_robot))
        if not self._filter.is_due(estimate.map_from_robot):
            return replace(estimate, insert=False)
        self._mapped.append((estimate.scan or seen.scan, estimate.map_from_robot @ seen.robot_from_lidar))
        return estimate

    def finish(self) -> None:
        """The wheels have no second thoughts."""

    def trajectory(self) -> Sequence[tuple[float, Pose2]]:
        return self._track

    def map(self) -> OccupancyGrid:
        mapper, grid = Mapper(), OccupancyGrid(self._grid)
        for scan, map_from_lidar in self._mapped:
            mapper.insert(scan, map_from_lidar, grid)
        return grid


def make_localizer(pose: PoseSource, grid: GridConfig) -> ReplayLocalizer:
    """A fresh one, with the defaults that every log is mapped with."""
    if pose == "odometry":
        return RememberedOdometry(grid)
    from occmap.localization.slam import SlamLocalizer

    return SlamLocalizer(grid=grid)


def save_slam(path: Path, localizer: ReplayLocalizer) -> None:
    """Write the state of a localizer that has one."""
    from occmap.localization.slam import SlamLocalizer
    from occmap.localization.state_file import save

    if not isinstance(localizer, SlamLocalizer):
        raise ValueError(f"a {type(localizer).__name__} has no state to save")
    save(path, localizer)


class MotionFilter:
    """Whether a robot has moved or turned enough since it last had that a scan tells something new.

    A robot that stands would otherwise turn its belief about passers-by into certainty.
    """

    def __init__(self, every_m: float = 0.05, every_rad: float = 0.05) -> None:
        self._every_m, self._every_rad = every_m, every_rad
        self._last: Pose2 | None = None

    def is_due(self, pose: Pose2) -> bool:
        """Whether it has; if so, its next movement is counted from this pose. The first pose is due."""
        if self._last is not None:
            moved = self._last.inverse() @ pose
            if np.hypot(moved.x_m, moved.y_m) < self._every_m and abs(moved.yaw_rad) < self._every_rad:
                return False
        self._last = pose
        return True
