"""The certificate of being done: each frontier that remains, and why it is left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.decision import Reason, UnknownLeft
from occmap.glimpses import glimpses
from occmap.grid import Belief, OccupancyGrid
from occmap.slices import Sliced

if TYPE_CHECKING:
    from occmap.body import Body
    from occmap.frontiers import Frontier
    from occmap.goal_config import GoalConfig
    from occmap.goal_search import GoalSearch
    from occmap.living_map import LivingMap
    from occmap.memory import FailedLooks
    from occmap.planner import Wavefront

FAR_M = 3.0
"""Farther than this from anywhere the body can be is far."""
REASON_CELLS = 10_000
"""What the reason for a frontier costs to find: see slices.Sliced."""


def certify(
    frontiers: Sequence[Frontier],
    grid: OccupancyGrid,
    wave: Wavefront,
    looks: FailedLooks,
    goals: GoalConfig,
    body_radius_m: float,
    unvisited: Sequence[Frontier] = (),
    beyond: Sequence[Frontier] = (),
    slits: Sequence[Frontier] = (),
    *,
    is_early: bool = True,
) -> Sliced[tuple[UnknownLeft, ...]]:
    """The reason for every frontier, given a flood of all that the body can reach.

    unvisited: those of the frontiers that could still be looked into: the run ends early, or they are not
    worth the way.
    beyond: others, on the far side of the boundary.
    slits: mouths of nooks along walls, which are no frontiers as such, not worth the way.
    """
    yield grid.state.size
    glimpsed = () if is_early else (yield from _only_glimpsed(grid))  # first: it takes the memory of a map
    yield grid.state.size
    reasons = Reasons(grid, wave, looks, goals.least_frontier_m(grid.frame.resolution_m), body_radius_m)
    yield grid.state.size
    could_be_looked_into = {id(frontier) for frontier in unvisited}

    def left(frontier: Frontier, reason: Reason, why: str) -> UnknownLeft:
        return UnknownLeft(frontier.centroid_in_map, reasons.size_m(frontier), reason, why)

    def own(frontier: Frontier) -> UnknownLeft:
        if reasons.is_sealed(frontier):
            return left(frontier, Reason.SEALED, "no free space leads to it")
        if id(frontier) not in could_be_looked_into:
            return left(frontier, *reasons.out_of_sight(frontier))
        if is_early:
            return left(frontier, Reason.UNVISITED, "in reach and worth a look, but the run ended first")
        return left(frontier, *reasons.not_worth_the_way(frontier, "{:.2f} m long"))

    listed: list[UnknownLeft] = []
    for frontier in frontiers:
        listed.append(own(frontier))
        yield REASON_CELLS
    for slit in slits:
        listed.append(left(slit, *reasons.not_worth_the_way(slit, "a slit {:.2f} m wide")))
        yield REASON_CELLS
    outside = (left(frontier, Reason.OUTSIDE, "beyond the boundary") for frontier in beyond)
    return (*listed, *glimpsed, *outside)


def certificate(
    search: GoalSearch,
    living_map: LivingMap,
    wave: Wavefront,
    body: Body,
    *,
    is_early: bool,
) -> Sliced[tuple[UnknownLeft, ...]]:
    """`certify` for the live map: collects what `search` could still visit, and the slits left."""
    frontiers, grid, slits = living_map.find_frontiers(), living_map.grid, []
    unvisited = yield from search.unvisited(frontiers, grid, wave)
    if not is_early:
        slits = yield from search.slits_left(grid, wave)
    return (
        yield from certify(
            frontiers, grid, wave, search.looks, search.chooser.config, body.radius_m, unvisited,
            living_map.frontiers_beyond, slits, is_early=is_early,
        )
    )  # fmt: skip


class Reasons:
    """Why frontiers are left, given a flood of all that the body can reach."""

    def __init__(
        self, grid: OccupancyGrid, wave: Wavefront, looks: FailedLooks, least_m: float, body_radius_m: float
    ) -> None:
        self._grid, self._looks = grid, looks
        self._least_m, self._body_radius_m = least_m, body_radius_m
        self._body = f"a body {2.0 * body_radius_m:.2f} m wide"
        cost, below = wave.raw_costs()
        self._reached = cost < below
        self._regions = np.empty(grid.shape, np.int32)
        ndimage.label(grid.state == Belief.FREE, output=self._regions)
        self._own_regions = np.unique(self._regions[self._reached])

    def size_m(self, frontier: Frontier) -> float:
        """Length of a frontier."""
        return frontier.size * self._grid.frame.resolution_m

    def is_sealed(self, frontier: Frontier) -> bool:
        """Whether no free cells lead to a frontier."""
        ix, iy = frontier.cells.T
        return not np.isin(self._regions[iy, ix], self._own_regions).any()

    def out_of_sight(self, frontier: Frontier) -> tuple[Reason, str]:
        """The reason for one that cannot be looked into, or that was, in vain.

        Where the body cannot come up to it, a gap too narrow for it is what is wrong, however short the
        part of it in sight is, and however often the robot has looked in from a distance.
        """
        size_m = self.size_m(frontier)
        is_short = size_m < self._least_m
        failed = [] if is_short else self._looks.at(frontier, self._grid)
        away_m = _distance_m(frontier, self._grid, self._reached)
        if self._is_apart(away_m, is_short=is_short) or not (is_short or failed):
            return Reason.TOO_NARROW, self._no_nearer(away_m)
        if is_short:
            return Reason.SPECK, f"{size_m:.2f} m long, shorter than the {self._least_m:.2f} m worth a look"
        return failed[-1].reason, f"{len(failed)} tries: {failed[-1].why}"

    def not_worth_the_way(self, frontier: Frontier, what: str) -> tuple[Reason, str]:
        """The reason for one that could be looked into, from near or afar; `what` is said of its length."""
        size_m = self.size_m(frontier)
        what = what.format(size_m)
        away_m = _distance_m(frontier, self._grid, self._reached)
        if size_m < 2.0 * self._body_radius_m:
            return Reason.TOO_NARROW, f"{what}: {self._body} does not fit, and it is not worth the way"
        if self._is_apart(away_m):
            return Reason.TOO_NARROW, f"{what}, seen from afar: {self._no_nearer(away_m)}, not worth the way"
        return Reason.SPECK, f"{what}: not worth the way"

    def _is_apart(self, away_m: float, *, is_short: bool = False) -> bool:
        corner_m = self._body_radius_m if is_short else 0.0  # noise flickers in corners, too
        return away_m >= self._body_radius_m + corner_m + 2.0 * self._grid.frame.resolution_m

    def _no_nearer(self, away_m: float) -> str:
        return f"{self._body} comes no nearer than {min(away_m, FAR_M):.2f} m"


def _only_glimpsed(grid: OccupancyGrid) -> Sliced[list[UnknownLeft]]:
    why, found = "glimpsed through a gap, by too few beams to tell", (yield from glimpses(grid))
    return [UnknownLeft(place, size_m, Reason.TOO_NARROW, why) for place, size_m in found]


def _distance_m(frontier: Frontier, grid: OccupancyGrid, reached: NDArray[np.bool_]) -> float:
    """Metres from a frontier to where the body can be; inf if nowhere within FAR_M along both axes."""
    reach = round(FAR_M / grid.frame.resolution_m)
    low = np.maximum(frontier.cells.min(axis=0) - reach, 0)
    high = frontier.cells.max(axis=0) + reach + 1
    window = reached[low[1] : high[1], low[0] : high[0]]
    if not window.any():
        return math.inf
    away = ndimage.distance_transform_edt(~window, return_indices=False)
    ix, iy = (frontier.cells - low).T
    return float(np.asarray(away)[iy, ix].min()) * grid.frame.resolution_m
