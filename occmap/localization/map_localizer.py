"""Localisation alone: following the robot in a finished map, and finding it there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from occmap.config_checks import Positive
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.localization.localizer import Estimate
from occmap.localization.matcher import Matcher
from occmap.localization.motion import MotionModel
from occmap.localization.place_search import PlaceSearch, PlaceSearchConfig
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
    search: PlaceSearchConfig = field(default_factory=PlaceSearchConfig)


class MapLocalizer:
    """Matches every scan against the nearest submap of a finished map; maps nothing.

    Without a start, or when scans stop fitting, it looks for the robot. Until then it goes by odometry;
    once it is found, the trajectory since it got lost is put right.
    """

    def __init__(
        self, finished: SlamLocalizer, start: Pose2 | None = None, config: MapLocalizerConfig | None = None
    ) -> None:
        self.config = config or MapLocalizerConfig()
        self._map_from_submap = finished.map_from_submap()
        self._submaps = finished.tracker.submaps
        if any(submap.cloud is None for submap in self._submaps) or not self._submaps:
            raise ValueError("the map is not finished: call finish() on its SlamLocalizer first")
        self._ready = finished.loops.ready
        self.slam_config = finished.config
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
        self._track: list[tuple[float, Pose2]] = []
        self._search: PlaceSearch | None = None
        self._searched_from = Pose2.identity()  # map_from_robot, as believed when the searched scan was taken

    @property
    def is_lost(self) -> bool:
        """Whether the robot has yet to be found; until then its pose is odometry's, from the last one on."""
        return self._misfits >= self.config.patience

    def update(self, seen: Observation) -> Estimate:
        """Where the robot is in the map. The map's grid is handed over with the first one."""
        prediction = self._motion.predict(seen)
        scan = undistorted(seen.scan, seen.robot_from_lidar, prediction.step, self._motion.step_s)
        cloud = Cloud.of(scan, seen.robot_from_lidar, self.slam_config.submap.reach_m)
        before, guess = self._pose, self._pose @ prediction.step
        submap = self._nearest(guess)
        map_from_submap = self._map_from_submap[submap]
        match = self._matcher.match(
            cloud, self._ready.use(submap), map_from_submap.inverse() @ guess, prediction
        )
        is_found = match.fit >= self.config.lost_fit and not self.is_lost
        self._pose = map_from_submap @ match.submap_from_robot if is_found else guess
        self._motion.took(
            before.inverse() @ self._pose, is_found and match.tells(prediction.sigma_m), is_found
        )
        self._misfits = 0 if is_found else self._misfits + 1
        self._track.append((seen.time_s, self._pose))
        if self.is_lost:
            self._look_around(cloud)
        grid, self._handed_over = None if self._handed_over else self._grid, True
        return Estimate(self._pose, insert=False, grid=grid, is_lost=self.is_lost)

    def finish(self) -> None:
        """There is nothing to settle: the map stays what it is."""

    def trajectory(self) -> Sequence[tuple[float, Pose2]]:
        """(time, map_from_robot) of every observation in turn, as it is known now."""
        return self._track

    def map(self) -> OccupancyGrid:
        """The finished map's."""
        return self._grid

    def _nearest(self, map_from_robot: Pose2) -> int:
        offset = self._centres - np.array(map_from_robot.position)
        return int(np.argmin((offset * offset).sum(axis=1)))

    def _look_around(self, cloud: Cloud) -> None:
        """A turn's part of a search for one scan; found, the robot is where it has moved to since."""
        if self._search is None:
            self._search = PlaceSearch(
                self.config.search, self._submaps, self._map_from_submap, self._matcher, cloud
            )
            self._searched_from = self._pose
        if not self._search.is_done:
            self._search.step()
        if not self._search.is_done:
            return
        place, self._search = self._search.place(), None
        if place is not None:
            self._put_right(place.map_from_robot @ self._searched_from.inverse())

    def _put_right(self, right_from_wrong: Pose2) -> None:
        """Move all that was believed since the scans stopped fitting."""
        since = max(0, len(self._track) - self._misfits)
        self._track[since:] = [(time_s, right_from_wrong @ pose) for time_s, pose in self._track[since:]]
        self._pose = right_from_wrong @ self._pose
        self._misfits = 0
