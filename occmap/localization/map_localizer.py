"""Localisation alone: following the robot in a finished map, and finding it there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from occmap.geometry import Pose2
from occmap.localization.localizer import Estimate
from occmap.localization.matcher import Match, Matcher, Search
from occmap.localization.motion import MotionModel
from occmap.localization.positive import Positive
from occmap.localization.slam import SlamLocalizer
from occmap.localization.surfel_map import Cloud
from occmap.localization.undistortion import undistorted
from occmap.scan import Observation


@dataclass(frozen=True)
class MapLocalizerConfig(Positive):
    """When the robot counts as lost, and how it is looked for."""

    lost_fit: float = 0.5
    """A scan of which less than this share lies on the map counts against the pose."""
    patience: int = 5
    """After so many such scans in a row the robot is lost."""
    found_fit: float = 0.6
    """What a scan must reach for the robot to be found."""
    window_m: float = 4.0
    """Half the width of the window searched round each submap's centre."""
    spacing_m: float = 0.2
    """Between the points searched with."""
    turn_step_rad: float = 0.02
    """Between two orientations searched."""
    apart: int = 2
    """One in so many submaps is searched: neighbours show the same."""


@dataclass(frozen=True)
class Sighting:
    """The best place found so far in a search, and how well the scan fits there."""

    map_from_robot: Pose2
    fit: float


class MapLocalizer:
    """Matches every scan against the nearest submap of a finished map; maps nothing.

    Without a start, or when scans stop fitting, it looks for the robot: one submap an update, by the
    best fit over all of them. Until then it goes by odometry.
    """

    def __init__(
        self, finished: SlamLocalizer, start: Pose2 | None = None, config: MapLocalizerConfig | None = None
    ) -> None:
        self.config = config or MapLocalizerConfig()
        self._map_from_submap = finished.map_from_submap()
        self._submaps = finished.tracker.submaps
        if any(submap.cloud is None for submap in self._submaps) or not self._submaps:
            raise ValueError("the map is not finished: call finish() on its SlamLocalizer first")
        self._slam_config = finished.config
        self._matcher = Matcher(finished.config.matcher)
        self._motion = MotionModel(finished.config.motion)
        self._centres = np.array(
            [
                pose.apply(np.array([submap.centre]))[0]
                for pose, submap in zip(self._map_from_submap, self._submaps, strict=True)
            ]
        )
        self._grid = finished.map()
        self._handed_over = False
        self._pose = start or Pose2.identity()
        self._misfits = 0 if start is not None else self.config.patience
        self._search: list[int] = []  # submaps still to be searched
        self._best: Sighting | None = None

    @property
    def is_lost(self) -> bool:
        return self._misfits >= self.config.patience

    def update(self, seen: Observation) -> Estimate:
        """Where the robot is in the map. The map's grid is handed over with the first one."""
        prediction = self._motion.predict(seen)
        scan = undistorted(seen.scan, seen.robot_from_lidar, prediction.step, self._motion.step_s)
        cloud = Cloud.of(scan, seen.robot_from_lidar, self._slam_config.submap.reach_m)
        before, guess = self._pose, self._pose @ prediction.step
        submap = self._nearest(guess)
        map_from_submap = self._map_from_submap[submap]
        match = self._matcher.match(
            cloud, self._submaps[submap], map_from_submap.inverse() @ guess, prediction
        )
        fits = match.fit >= self.config.lost_fit
        self._pose = map_from_submap @ match.submap_from_robot if fits and not self.is_lost else guess
        self._motion.took(before.inverse() @ self._pose)
        self._misfits = 0 if fits and not self.is_lost else self._misfits + 1
        if self.is_lost:
            self._look_around(cloud, prediction.step)
        grid, self._handed_over = None if self._handed_over else self._grid, True
        return Estimate(self._pose, insert=False, grid=grid)

    def _nearest(self, map_from_robot: Pose2) -> int:
        offset = self._centres - np.array(map_from_robot.position)
        return int(np.argmin((offset * offset).sum(axis=1)))

    def _look_around(self, cloud: Cloud, step: Pose2) -> None:
        """Search one more submap; after the last one, the best place is where the robot is."""
        if not self._search:
            self._search = list(range(0, len(self._submaps), self.config.apart))
            self._best = None
        if self._best is not None:
            self._best = Sighting(self._best.map_from_robot @ step, self._best.fit)
        k = self._search.pop()
        match = self._find(cloud, k)
        if match is not None and (self._best is None or match.fit > self._best.fit):
            self._best = Sighting(self._map_from_submap[k] @ match.submap_from_robot, match.fit)
        self._submaps[k].release()
        if not self._search and self._best is not None and self._best.fit >= self.config.found_fit:
            self._pose, self._misfits = self._best.map_from_robot, 0

    def _find(self, cloud: Cloud, submap: int) -> Match | None:
        """Where in one submap a scan fits best, whatever the robot's heading."""
        c, target = self.config, self._submaps[submap]
        points = self._matcher.thinned(cloud.points, c.spacing_m)
        if len(points) == 0:
            return None
        least = 0.5 if self._best is None else 0.5 * self._best.fit
        where = Search(Pose2(*target.centre, 0.0), c.window_m, math.pi, c.turn_step_rad, least_score=least)
        found, score = self._matcher.search(points, target, where)
        if score <= least:
            return None
        return self._matcher.refine(cloud, target, found, found, 1e-3 * np.eye(3))
