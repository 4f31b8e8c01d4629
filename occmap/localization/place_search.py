"""Where in a finished map a single scan was taken: all submaps are searched, a slice a turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from occmap.config_checks import Positive
from occmap.geometry import Pose2, wrap_angle
from occmap.localization.loop_comparison import HARDLY_A_PRIOR
from occmap.localization.matcher import Matcher
from occmap.localization.submap import Submap
from occmap.localization.surfel_map import Cloud
from occmap.localization.window import Window
from occmap.localization.window_search import WindowSearch

RIVAL_SHARE = 0.7
"""A place whose score on the raster is less than this share of the best fit cannot rival it."""


@dataclass(frozen=True)
class PlaceSearchConfig(Positive):
    """How a lost robot is looked for."""

    found_fit: float = 0.6
    """Share of a scan's points that must lie on the map for the robot to be found."""
    rival_gain: float = 0.1
    """And by so much must it be better than anywhere else: rooms look alike."""
    rival_m: float = 0.5
    """Nearer poses are the same place."""
    rival_rad: float = 0.3
    """Unless they look elsewhere by more than this."""
    least_score: float = 0.45
    """Mean likelihood on the raster that a place must reach to be looked at more closely."""
    window_m: float = 4.0
    """Half the width of the window searched round each submap's centre."""
    spacing_m: float = 0.2
    """Between the points searched with."""
    off_m: float = 0.05
    """Between two orientations searched, the farthest point is off by at most this."""
    apart: int = 2
    """One in so many submaps is searched: neighbours show the same."""
    work_per_turn: int = 4_000_000
    """Points looked up in one turn of the robot: some milliseconds."""


@dataclass(frozen=True)
class Sighting:
    """A place where a scan fits, and how well."""

    map_from_robot: Pose2
    fit: float


class PlaceSearch:
    """The places in a map of submaps where one scan, a cloud of the robot's frame, fits."""

    def __init__(
        self,
        config: PlaceSearchConfig,
        submaps: Sequence[Submap],
        map_from_submap: Sequence[Pose2],
        matcher: Matcher,
        cloud: Cloud,
    ) -> None:
        self.config = config
        self.sightings: list[Sighting] = []
        self._submaps, self._map_from_submap, self._matcher = submaps, map_from_submap, matcher
        self._cloud, self._points = cloud, matcher.thinned(cloud.points, config.spacing_m)
        self._left = list(range(0, len(submaps), config.apart)) if len(self._points) else []
        self._search: WindowSearch | None = None

    @property
    def is_done(self) -> bool:
        """Whether all submaps have been searched."""
        return not self._left

    def step(self) -> None:
        """Do a turn's part of the search."""
        submap = self._submaps[self._left[-1]]
        if self._search is None:
            self._search = WindowSearch(self._points, submap.raster, self._window(submap))
        self._search.step(submap.raster, self.config.work_per_turn)
        if not self._search.is_done:
            return
        if self._search.found:
            self._look_closely(submap, self._search.best)
        submap.release()
        self._search = None
        self._left.pop()

    def place(self) -> Sighting | None:
        """The place where the robot must have been; None if it may have been nowhere, or in several."""
        c = self.config
        if not self.sightings:
            return None
        best = max(self.sightings, key=lambda sighting: sighting.fit)
        rivals = [s for s in self.sightings if s.fit > best.fit - c.rival_gain and not self._is_same(best, s)]
        return best if best.fit >= c.found_fit and not rivals else None

    def _is_same(self, a: Sighting, b: Sighting) -> bool:
        turn = abs(wrap_angle(a.map_from_robot.yaw_rad - b.map_from_robot.yaw_rad))
        apart_m = a.map_from_robot.distance_to(b.map_from_robot)
        return apart_m < self.config.rival_m and turn < self.config.rival_rad

    def _window(self, submap: Submap) -> Window:
        c = self.config
        reach_m = max(1.0, float(np.hypot(*self._points.T).max()))
        best_fit = max((sighting.fit for sighting in self.sightings), default=0.0)
        least = max(c.least_score, RIVAL_SHARE * best_fit)
        return Window(Pose2(*submap.centre, 0.0), c.window_m, math.pi, 2.0 * c.off_m / reach_m, least)

    def _look_closely(self, submap: Submap, found: Pose2) -> None:
        match = self._matcher.refine(self._cloud, submap, found, found, HARDLY_A_PRIOR)
        map_from_submap = self._map_from_submap[self._left[-1]]
        self.sightings.append(Sighting(map_from_submap @ match.submap_from_robot, match.fit))
