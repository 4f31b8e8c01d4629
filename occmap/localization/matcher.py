"""Finds the pose at which points fit a submap: a correlative search, then Gauss-Newton."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.geometry import Points, Pose2
from occmap.localization.likelihood_pyramid import HIGHEST
from occmap.localization.motion import Prediction
from occmap.localization.submap import Submap
from occmap.localization.surfel_map import Cloud
from occmap.localization.window import Window

COARSE = 2.0
"""A search through a wide window does with points, and turns, so many times as far apart."""
LET_GO_CHI2 = 9.0
"""Where the search ends up so far off the prediction, that weighs a quarter in the refinement."""
SECOND_PRIOR_SHARE = 0.01
"""Of the prediction's weight, what is left of it at a second look: it has been wrong once."""
HELD = 1e12
"""Information that no scan can outweigh."""
NEAREST_M, FARTHEST_M = 1.0, 15.0
"""Within these, the farthest point decides how finely turns are searched."""


@dataclass(frozen=True)
class MatcherConfig(Positive):
    """How points are fitted to a submap."""

    spacing_m: float = 0.10
    """The search uses points at least this far apart, so that near walls do not outvote far ones."""
    prior_cost: float = 0.02
    """Score that a candidate sqrt(2) standard deviations off the prediction must make up for."""
    prior_cap: float = 0.06
    """The most score that the prediction can cost: wheels may be plain wrong."""
    many_points: int = 60
    """The score of fewer points than this is less sure, and the prediction costs as much more."""
    sigma_m: float = 0.03
    """Standard deviation of one point's residual. Above the sensor's, since neighbours err together, but the
    larger it is, the more a wheel that is too small pulls the poses, and with them the map, to its side."""
    wide_m: float = 0.15
    """Scale of the robust loss at first."""
    narrow_m: float = 0.10
    """Scale of the robust loss in the end."""
    sure_fit: float = 0.8
    """If so large a share of the points lies on the map less than a standard deviation from where it was
    expected, nothing is searched,"""
    sure_sigma_m: float = 0.1
    """unless that standard deviation is larger than this. From so far off Gauss-Newton misses the few points
    that tell how far along a corridor a robot is, and it stands or runs on for ever."""
    doubtful_fit: float = 0.6
    """If a smaller share of the points lies on the map, a wider window is searched."""
    doubtful_share: float = 0.8
    """Also if it is smaller than this part of what usually does: so well another place may fit."""
    second_look_m: float = 1.0
    """Its half width."""
    second_look_rad: float = 1.6
    """And how far it turns."""
    second_gain: float = 0.1
    """What must be gained there for the prediction to be given up."""
    second_gain_sigmas: float = 3.0
    """And so many standard deviations of the share of as many points as there are."""
    surprising: float = 2.0
    """Chi2 against the prediction beyond which what the search found must be better than that."""
    surprise_sigmas: float = 0.5
    """The share of points on the map must then be larger by so many of its standard deviations, and by more
    the farther off, up to second_gain_sigmas: all poses along a corridor fit, and the wheels know better."""
    rival_m: float = 0.5
    """After a gap, no place so far from the one found may look as much like it."""
    rival_share: float = 0.85
    """Of the found place's score on the raster, that a rival has."""
    iterations: int = 6
    """Gauss-Newton steps at each scale, at most."""
    strayed_m: float = 0.1
    """A refinement that ends farther than this from the best pose on the raster is looked at again: what is
    near, a passer-by or a chair, is hit by most of the beams, and drags the others along."""


@dataclass(frozen=True)
class Match:
    """Where points fit a submap."""

    submap_from_robot: Pose2
    information: NDArray[np.float64]  # (3, 3) of x, y, yaw in the submap's frame, from the points alone
    posterior: NDArray[np.float64]  # (3, 3) the same with the prediction's
    fit: float
    """Share of the points that lie on the map, 0 to 1."""

    @property
    def is_blind_to_turns(self) -> bool:
        """Whether the points alone know the turn less well than the prediction."""
        return bool(2.0 * self.information[2, 2] < self.posterior[2, 2])

    def tells(self, sigma_m: float) -> bool:
        """Whether the points alone know the position twice as well, along every axis."""
        xx, xy, yy = self.information[0, 0], self.information[0, 1], self.information[1, 1]
        least = 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy)
        return bool(least * sigma_m * sigma_m > 4.0)


class Matcher:
    """Olson 2009 for the search; point-to-line Gauss-Newton (Censi 2008) for the last centimetre."""

    def __init__(self, config: MatcherConfig | None = None) -> None:
        self.config = config or MatcherConfig()
        self._scales = np.array([self.config.wide_m, self.config.narrow_m])

    def match(
        self, cloud: Cloud, submap: Submap, guess: Pose2, prediction: Prediction, usual_fit: float = 0.0
    ) -> Match:
        """A cloud of the robot's frame against a submap, near a guess of submap_from_robot."""
        prior = np.diag([prediction.sigma_m**-2, prediction.sigma_m**-2, prediction.sigma_rad**-2])
        expected = self.refine(cloud, submap, guess, guess, prior)
        off = prediction.surprise(guess, expected.submap_from_robot)
        is_sharp = prediction.sigma_m <= self.config.sure_sigma_m
        if is_sharp and expected.fit >= self.config.sure_fit and off < 1.0:
            return expected  # just where it was expected: nothing to search for
        start = self._track(cloud.points, submap, guess, prediction)
        surprise = prediction.surprise(guess, start)
        if surprise > self.config.surprising:  # perhaps the wheels erred in their turn alone
            turned = Pose2(guess.x_m, guess.y_m, start.yaw_rad)
            expected = max(
                expected, self.refine(cloud, submap, turned, guess, prior), key=lambda match: match.fit
            )
        # a search that went elsewhere has caught the wheels lying: Cauchy-like, let go of them
        prior = prior / (1.0 + surprise / LET_GO_CHI2) ** 2
        match = self._unstrayed(cloud, submap, start, guess, prior)
        if surprise > self.config.surprising and match.fit < expected.fit + self._gain(surprise, cloud):
            match = expected
        if match.fit < max(self.config.doubtful_fit, self.config.doubtful_share * usual_fit):
            match = self._second_look(cloud, submap, guess, prior, match, prediction)
        return match

    def _gain(self, surprise: float, cloud: Cloud) -> float:
        """By how much better a cloud must fit so far off the prediction to be believed to be there."""
        c = self.config
        sigmas = c.surprise_sigmas * math.sqrt(surprise / c.surprising)
        return min(sigmas, c.second_gain_sigmas) * by_chance(cloud)

    def _unstrayed(
        self, cloud: Cloud, submap: Submap, start: Pose2, guess: Pose2, prior: NDArray[np.float64]
    ) -> Match:
        """The refinement; if it strays to where the raster likes it less, that of points spaced evenly."""
        match = self.refine(cloud, submap, start, guess, prior)
        if match.submap_from_robot.distance_to(start) <= self.config.strayed_m:
            return match
        even = cloud.spaced(self.config.spacing_m)
        there, here = (self._score(even.points, submap, pose) for pose in (match.submap_from_robot, start))
        return match if there >= here else self.refine(even, submap, start, guess, prior)

    def _score(self, points: Points, submap: Submap, pose: Pose2) -> float:
        """How well points fit the raster at one pose: mean likelihood, 0 to 1."""
        return self.search(points, submap, Window(pose, 0.0, 0.0, 1.0))[1]

    def _second_look(
        self,
        cloud: Cloud,
        submap: Submap,
        guess: Pose2,
        prior: NDArray[np.float64],
        first: Match,
        prediction: Prediction,
    ) -> Match:
        """A scan that fits badly where it was expected may fit well elsewhere: wheels slip."""
        c = self.config
        reach_m = min(c.second_look_m, prediction.most_m)
        reach_rad = min(c.second_look_rad, prediction.most_rad)
        apart = self.thinned(cloud.points, COARSE * c.spacing_m)
        if len(apart) == 0:
            return first
        turn_step = angle_step(apart, COARSE * submap.raster.cell_m)
        found, _ = self.search(apart, submap, Window(guess, reach_m, reach_rad, turn_step))
        second = self.refine(cloud, submap, found, guess, SECOND_PRIOR_SHARE * prior)
        gain = max(c.second_gain, c.second_gain_sigmas * by_chance(cloud))
        return second if second.fit > first.fit + gain else first

    def has_rival(self, cloud: Cloud, submap: Submap, match: Match, prediction: Prediction) -> bool:
        """Whether the cloud fits nearly as well elsewhere in the window of a prediction."""
        c, found = self.config, match.submap_from_robot
        apart = self.thinned(cloud.points, COARSE * c.spacing_m)
        if len(apart) == 0:
            return True
        step = angle_step(apart, COARSE * submap.raster.cell_m)
        _, score = self.search(apart, submap, Window(found, c.rival_m, step, step))
        nearly = c.rival_share * score
        wide = Window(found, prediction.window_m, prediction.window_rad, step, nearly, found, c.rival_m)
        return self.search(apart, submap, wide)[1] > nearly

    def _track(self, points: Points, submap: Submap, guess: Pose2, prediction: Prediction) -> Pose2:
        """The best pose on the raster near the guess, weighed against the prediction."""
        apart = self.thinned(points, self.config.spacing_m)
        if len(apart) == 0:
            return guess
        step = angle_step(points, submap.raster.cell_m)
        window = Window(guess, prediction.window_m, prediction.window_rad, step)
        return self.search(apart, submap, window, prediction.sigma_m, prediction.sigma_rad)[0]

    def search(
        self,
        points: Points,
        submap: Submap,
        window: Window,
        sigma_m: float = math.inf,
        sigma_rad: float = math.inf,
    ) -> tuple[Pose2, float]:
        """Best pose on the raster and its score (mean likelihood, 0 to 1); least_score if there is none.

        sigma: how far from the guess the pose may well be; finite, it costs score to be farther.
        """
        from occmap.localization import search_kernels

        raster, guess, whole = submap.raster, window.guess, HIGHEST * len(points)
        few = HIGHEST * max(len(points), self.config.many_points)
        turn, x, y, score = search_kernels.search(
            raster.buffer,
            raster.starts,
            raster.shapes,
            points,
            *raster.origin_m,
            1.0 / raster.cell_m,
            np.array([guess.x_m, guess.y_m, guess.yaw_rad]),
            window.half_turns,
            window.turn_step_rad,
            window.half_cells(raster.cell_m),
            few * self.config.prior_cost * (raster.cell_m / sigma_m) ** 2,
            few * self.config.prior_cost * (window.turn_step_rad / sigma_rad) ** 2,
            few * self.config.prior_cap,
            whole * window.least_score,
            window.shunned(raster.cell_m),
        )
        return window.pose(turn, x, y, raster.cell_m), score / whole

    def fit_at(self, cloud: Cloud, submap: Submap, pose: Pose2) -> float:
        """Share of the points that lie on the map at just this pose."""
        return self.refine(cloud, submap, pose, pose, HELD * np.eye(3)).fit

    def thinned(self, points: Points, spacing_m: float) -> Points:
        """The points at least so far from the last one kept, in order."""
        from occmap.localization import cloud_kernels

        return points[cloud_kernels.spaced(points, spacing_m)]

    def refine(self, cloud: Cloud, submap: Submap, start: Pose2, prior: Pose2,
               prior_information: NDArray[np.float64]) -> Match:  # fmt: skip
        """Gauss-Newton from start, pulled to a prior by its (3, 3) information."""
        from occmap.localization import surfel_kernels

        m, c = submap.surfels, self.config
        pose, information, weight = surfel_kernels.refine(
            m.index, m.rows, *m.origin_m, m.voxels_per_m, cloud.points, cloud.facing,
            np.array([start.x_m, start.y_m, start.yaw_rad]), np.array([prior.x_m, prior.y_m, prior.yaw_rad]),
            prior_information, c.sigma_m, self._scales, c.iterations,
        )  # fmt: skip
        return Match(
            Pose2(*pose), information, information + prior_information, weight / max(1, len(cloud.points))
        )


def by_chance(cloud: Cloud) -> float:
    """Standard deviation of the share of a cloud's points that lie on the map, at most."""
    return math.sqrt(0.25 / max(len(cloud.points), 1))


def angle_step(points: Points, cell_m: float) -> float:
    """The turn that moves the farthest point by about a cell; far stragglers do not count."""
    reach = float(np.sqrt((points * points).sum(axis=1).max()))
    return cell_m / min(max(reach, NEAREST_M), FARTHEST_M)


def axes(yaw_rad: float) -> NDArray[np.float64]:
    """(3, 3) rotation of (x, y, yaw): `axes(a_from_b.yaw_rad)` takes coordinates in b's axes to a's."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
