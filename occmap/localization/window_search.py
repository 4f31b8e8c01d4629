"""A correlative search through a wide window, spread over as many turns as it takes."""

from __future__ import annotations

import math

import numpy as np

from occmap.geometry import Points, Pose2
from occmap.localization.likelihood_pyramid import HIGHEST, LikelihoodPyramid, top_blocks
from occmap.localization.window import SCORE, Window

NOWHERE_LIKELIER = (0.0, 0.0, 0.0)
"""What shifts and turns cost: what is looked for may be anywhere in the window."""


class WindowSearch:
    """The pose of points (n, 2) that scores best on a raster (mean likelihood, 0 to 1), exactly.

    Depth-first branch and bound (Olson 2009; Hess et al. 2016, algorithm 3). `step` does a slice of it,
    measured in points looked up and not in time, so that the same input always takes the same turns.
    """

    def __init__(self, points: Points, raster: LikelihoodPyramid, window: Window) -> None:
        self.window = window
        self.is_done = len(points) == 0
        self._points = points
        self._cell_m, self._origin_m = raster.cell_m, raster.origin_m
        self._half_angles = window.half_turns
        self._half_cells = window.half_cells(raster.cell_m)
        self._top, blocks = top_blocks(self._half_cells)
        self._bounds = np.empty((2 * self._half_angles + 1, blocks, blocks))
        self._angles_bounded = 0
        self._order = np.empty(0, np.int64)
        self._next = 0
        self._best = np.array([0.0, 0.0, 0.0, math.floor(HIGHEST * len(points) * window.least_score)])
        self._shun = window.shunned(raster.cell_m)

    @property
    def best(self) -> Pose2:
        """The best pose so far."""
        turn, x, y, _ = self._best.tolist()
        return self.window.pose(turn, x, y, self._cell_m)

    @property
    def score(self) -> float:
        """Score of the best pose so far; about least_score if none is better."""
        return float(self._best[SCORE]) / (HIGHEST * max(1, len(self._points)))

    @property
    def found(self) -> bool:
        """Whether any pose so far scores more than the window asks for."""
        return self.score > self.window.least_score

    def step(self, raster: LikelihoodPyramid, work: int) -> int:
        """Look up about so many points on the raster; returns how much of the work is left over."""
        if not self.is_done and self._angles_bounded < len(self._bounds):
            work = self._bound(raster, work)
        if not self.is_done and self._angles_bounded == len(self._bounds) and work > 0:
            work = self._descend(raster, work)
        return work

    def _bound(self, raster: LikelihoodPyramid, work: int) -> int:
        from occmap.localization import search_kernels as kernels

        an_angle = len(self._points) * self._bounds.shape[1] ** 2
        first = self._angles_bounded
        last = min(len(self._bounds), first + max(1, work // an_angle))
        kernels.bounds(*self._problem(raster), first, last, self._bounds)
        self._angles_bounded = last
        if last == len(self._bounds):
            worth = np.flatnonzero(self._bounds.ravel() > self._best[SCORE])
            self._order = worth[np.argsort(-self._bounds.ravel()[worth], kind="stable")]
        return work - (last - first) * an_angle

    def _descend(self, raster: LikelihoodPyramid, work: int) -> int:
        from occmap.localization import search_kernels as kernels

        self._next, left = kernels.descend(
            *self._problem(raster),
            self._bounds,
            self._order,
            self._next,
            self._best,
            self._shun,
            work,
            self.window.any_will_do,
        )
        self.is_done = self._next == len(self._order) or (self.window.any_will_do and self.found)
        return left

    def _problem(self, raster: LikelihoodPyramid):
        """Arguments that both kernels share, in their order."""
        guess, (origin_x, origin_y) = self.window.guess, self._origin_m
        return (
            raster.buffer,
            raster.starts,
            raster.shapes,
            self._points,
            origin_x,
            origin_y,
            1.0 / self._cell_m,
            np.array([guess.x_m, guess.y_m, guess.yaw_rad]),
            self._half_angles,
            self.window.turn_step_rad,
            self._half_cells,
            self._top,
            NOWHERE_LIKELIER,
        )
