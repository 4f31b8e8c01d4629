"""Whether two submaps show the same place: searched, refined and looked through, a slice a turn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from occmap.config_checks import Positive
from occmap.geometry import Points, Pose2
from occmap.localization.loop_candidates import Candidate
from occmap.localization.matcher import Match, Matcher
from occmap.localization.submap import Submap, share_seen_through
from occmap.localization.surfel_map import Cloud
from occmap.localization.surfel_rows import COUNT, FLAT, FLATNESS, MEAN, NORMAL, VIEW
from occmap.localization.window import Window
from occmap.localization.window_search import WindowSearch

SEEN_TWICE = 2.0
"""Points of a surfel that is no stray return."""
KEY_STRIDE = 1_000_003
"""Squares (x, y) become one number by it: more than there are squares side by side."""
HARDLY_A_PRIOR = 1e-3 * np.eye(3)
"""Information of x, y, yaw: the points decide, and where they tell nothing the pose stays as it is."""


@dataclass(frozen=True)
class ComparisonConfig(Positive):
    """How far two submaps are searched for the same place, and what they must show."""

    window_m: float = 0.3
    """A search looks this far beyond three standard deviations."""
    window_rad: float = 0.06
    """And turns this far beyond."""
    max_window_m: float = 16.0
    """But never farther: a loop lost by more is not found."""
    max_window_rad: float = 1.6
    """And never turns farther: three standard deviations after half a minute with wheels alone."""
    off_m: float = 0.05
    """Between two orientations searched, the farthest point is off by at most this."""
    least_work: int = 40_000_000
    """Points looked up for one pair; what is not clear by then is too much alike to be told apart."""
    work_per_m2: int = 400_000
    """But so many for every square metre of the window, if that is more."""
    query_radius_m: float = 10.0
    """Surfels this near to where the robot was are compared."""
    query_most_m: float = 30.0
    """And farther ones, to at most this far, until there are query_points: squares are emptier than rooms."""
    query_points: int = 250
    """So many are enough to recognise a place."""
    query_spacing_m: float = 0.25
    """So far apart in the search."""
    refine_spacing_m: float = 0.10
    """And so far apart in the refinement."""
    least_points: int = 50
    """A submap of fewer surfels than this is too empty to be recognised."""
    least_score: float = 0.45
    """Mean likelihood on the raster that a search must reach."""
    rival_m: float = 0.5
    """In a wider window, no pose so far from the best one may score nearly as well: a corridor with a door
    every few metres looks the same a few metres on."""
    rival_share: float = 0.8
    """Of the best score, that a rival has,"""
    rival_points: float = 10.0
    """and fewer points than this are missing to all of it. Along a corridor every pose has most of the best
    score by the walls alone: what tells one from another are the few points of doors and niches."""
    least_fit: float = 0.5
    """Share of the surfels that must lie on the other submap after refinement."""
    most_seen_through: float = 0.07
    """Share of either's points that the other may have looked straight through. People are not among them,
    and where two submaps do show the same place it is hardly ever more than half of this."""


class Comparison:
    """Compares one pair: seeks the best pose, then another nearly as good, and then looks closer."""

    def __init__(self, config: ComparisonConfig, pair: Candidate, younger: Submap, predicted: Pose2) -> None:
        self.pair, self.predicted = pair, predicted
        self.match: Match | None = None
        """What came of it: None if these are not seen to be the same place."""
        self._config = config
        self._points = seen_nearby(younger, config.query_spacing_m, config).points
        self._search: WindowSearch | None = None
        self._best: WindowSearch | None = None
        self._work = config.least_work

    def step(self, older: Submap, younger: Submap, matcher: Matcher, work: int) -> bool:
        """Do a slice of it; True once there is nothing more to find out."""
        c = self._config
        if self._search is None:
            if len(self._points) < c.least_points:
                return True
            window = self._window()
            self._search = WindowSearch(self._points, older.raster, window)
            self._work = max(self._work, round(c.work_per_m2 * (2.0 * window.half_width_m) ** 2))
        self._work -= work
        self._search.step(older.raster, work)
        if not self._search.is_done:
            return self._work <= 0
        if self._best is None:
            if not self._search.found:
                return True
            self._best = self._search
            if self._best.window.half_width_m > c.rival_m:
                self._search = WindowSearch(self._points, older.raster, self._elsewhere(self._best))
                return False
        elif self._search.found:
            return True  # this place has a rival
        self.match = closer_look(c, older, younger, matcher, self._best.best)
        return True

    def _window(self) -> Window:
        """The window round the prediction, as far as that may be wrong."""
        c, pair = self._config, self.pair
        reach_m = float(np.hypot(*(self._points - self._points.mean(axis=0)).T).max())
        return Window(
            self.predicted,
            min(3.0 * pair.sigma_m + c.window_m, c.max_window_m),
            min(3.0 * pair.sigma_rad + c.window_rad, c.max_window_rad),
            2.0 * c.off_m / max(reach_m, c.query_radius_m),
            c.least_score,
        )

    def _elsewhere(self, best: WindowSearch) -> Window:
        """The same window but for the best pose, and only what is nearly as good."""
        c = self._config
        nearly = max(c.rival_share * best.score, best.score - c.rival_points / len(self._points))
        return replace(best.window, least_score=nearly, shun=best.best, shun_m=c.rival_m, any_will_do=True)


def closer_look(
    config: ComparisonConfig, older: Submap, younger: Submap, matcher: Matcher, found: Pose2
) -> Match | None:
    """The pose near one found, if there the younger lies on the older and neither looks through the other."""
    cloud = seen_nearby(younger, config.refine_spacing_m, config)
    match = matcher.refine(cloud, older, found, found, HARDLY_A_PRIOR)
    if match.fit < config.least_fit:
        return None
    through = _seen_through(config, older, younger, match)
    return match if through <= config.most_seen_through else None


def _seen_through(config: ComparisonConfig, older: Submap, younger: Submap, match: Match) -> float:
    """The larger share of either submap's points that the other has looked straight through."""
    older_from_younger, spacing_m = match.submap_from_robot, config.query_spacing_m
    ours, theirs = (seen_nearby(each, spacing_m, config).points for each in (younger, older))
    return max(
        share_seen_through(older, older_from_younger.apply(ours)),
        share_seen_through(younger, older_from_younger.inverse().apply(theirs)),
    )


def seen_nearby(submap: Submap, spacing_m: float, config: ComparisonConfig) -> Cloud:
    """The surfels seen at least twice, near where the robot was; the surest of each square of this side."""
    assert submap.cloud is not None, "only finished submaps are compared"
    rows = submap.cloud.rows
    rows = rows[rows[:, COUNT] >= SEEN_TWICE]
    rows = rows[np.argsort(-rows[:, COUNT], kind="stable")]
    square = np.floor(rows[:, MEAN] / spacing_m).astype(np.int64)
    _, first = np.unique(square[:, 0] * KEY_STRIDE + square[:, 1], return_index=True)
    rows = rows[np.sort(first)].astype(np.float64)
    distance_m = np.hypot(*(rows[:, MEAN] - np.asarray(submap.centre)).T)
    enough = round(config.query_points * config.query_spacing_m / spacing_m)
    far_m = np.sort(distance_m)[enough] if len(rows) > enough else config.query_most_m
    rows = rows[distance_m < min(max(far_m, config.query_radius_m), config.query_most_m)]
    facing = np.where(rows[:, FLATNESS, None] > FLAT, rows[:, NORMAL], rows[:, VIEW])
    points = np.ascontiguousarray(rows[:, MEAN])
    return Cloud(points, np.ascontiguousarray(facing))


def centre_of_sight(submap: Submap, config: ComparisonConfig) -> Points:
    """(2,) the middle of what a submap shows, in its frame: ahead of a robot that looks ahead.

    Two submaps driven through in opposite directions show the same where these meet, not the robots.
    """
    points = seen_nearby(submap, config.query_spacing_m, config).points
    return points.mean(axis=0) if len(points) else np.array(submap.centre)
