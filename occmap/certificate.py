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

if TYPE_CHECKING:
    from occmap.frontiers import Frontier
    from occmap.goal_config import GoalConfig
    from occmap.memory import FailedLooks
    from occmap.planner import Wavefront

FAR_M = 3.0
"""Farther than this from anywhere the body can be is far."""


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
) -> tuple[UnknownLeft, ...]:
    """The reason for every frontier, given a flood of all that the body can reach.

    unvisited: those of the frontiers that could still be looked into: the run ends early, or they are not
    worth the way.
    beyond: others, on the far side of the boundary.
    slits: mouths of nooks along walls, which are no frontiers as such, not worth the way.

    Where the body cannot come up to a frontier, a gap too narrow for it is what is wrong, however short
    the part of it in sight is, and however often the robot has looked in from a distance.
    """
    cost, below = wave.fixed_point()
    reached = cost < below
    regions = np.empty(grid.shape, np.int32)
    ndimage.label(grid.state == Belief.FREE, output=regions)
    own_regions = np.unique(regions[reached])

    body = f"a body {2.0 * body_radius_m:.2f} m wide"
    least_m = goals.least_frontier_m(grid.frame.resolution_m)

    def reason_for(frontier: Frontier) -> tuple[Reason, str]:
        size_m = frontier.size * grid.frame.resolution_m
        if not np.isin(regions[frontier.cells[:, 1], frontier.cells[:, 0]], own_regions).any():
            return Reason.SEALED, "no free space leads to it"
        is_worth_a_look = size_m >= least_m
        is_unvisited = is_worth_a_look and any(frontier is other for other in unvisited)
        if is_unvisited and is_early:
            return Reason.UNVISITED, "in reach and worth a look, but the run ended first"
        failed = looks.at(frontier, grid) if is_worth_a_look else []
        away_m = _distance_m(frontier, grid, reached)
        corner_m = 0.0 if is_worth_a_look else body_radius_m  # noise flickers in corners, too
        is_apart = away_m >= body_radius_m + corner_m + 2.0 * grid.frame.resolution_m
        if is_apart or (is_worth_a_look and not failed and not is_unvisited):
            return Reason.TOO_NARROW, f"{body} comes no nearer than {min(away_m, FAR_M):.2f} m"
        if is_unvisited:
            return not_worth_the_way(size_m, f"{size_m:.2f} m long")
        if not is_worth_a_look:
            return Reason.SPECK, f"{size_m:.2f} m long, shorter than the {least_m:.2f} m worth a look"
        return failed[-1].reason, f"{len(failed)} tries: {failed[-1].why}"

    def not_worth_the_way(size_m: float, what: str) -> tuple[Reason, str]:
        if size_m < 2.0 * body_radius_m:
            return Reason.TOO_NARROW, f"{what}: {body} does not fit, and it is not worth the way"
        return Reason.SPECK, f"{what}: not worth the way"

    def left(frontier: Frontier, reason: Reason, why: str) -> UnknownLeft:
        return UnknownLeft(frontier.centroid_in_map, frontier.size * grid.frame.resolution_m, reason, why)

    def slit(mouth: Frontier) -> UnknownLeft:
        width_m = mouth.size * grid.frame.resolution_m
        return left(mouth, *not_worth_the_way(width_m, f"a slit {width_m:.2f} m wide"))

    own = (left(frontier, *reason_for(frontier)) for frontier in frontiers)
    outside = (left(frontier, Reason.OUTSIDE, "beyond the boundary") for frontier in beyond)
    return (*own, *map(slit, slits), *(() if is_early else _only_glimpsed(grid)), *outside)


def _only_glimpsed(grid: OccupancyGrid) -> list[UnknownLeft]:
    why = "glimpsed through a gap, by too few beams to tell"
    return [UnknownLeft(place, size_m, Reason.TOO_NARROW, why) for place, size_m in glimpses(grid)]


def _distance_m(frontier: Frontier, grid: OccupancyGrid, reached: NDArray[np.bool_]) -> float:
    """From a frontier to where the body can be; inf beyond FAR_M."""
    reach = round(FAR_M / grid.frame.resolution_m)
    low = np.maximum(frontier.cells.min(axis=0) - reach, 0)
    high = frontier.cells.max(axis=0) + reach + 1
    window = reached[low[1] : high[1], low[0] : high[0]]
    if not window.any():
        return math.inf
    away = ndimage.distance_transform_edt(~window, return_indices=False)
    ix, iy = (frontier.cells - low).T
    return float(np.asarray(away)[iy, ix].min()) * grid.frame.resolution_m
