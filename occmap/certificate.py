"""The certificate of being done: each frontier that remains, and why it is left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.decision import Reason, UnknownLeft
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

    Where the body cannot come up to a frontier, a gap too narrow for it is what is wrong, however often
    the robot has looked in from a distance.
    """
    cost, below = wave.fixed_point()
    reached = cost < below
    regions = np.empty(grid.shape, np.int32)
    ndimage.label(grid.state == Belief.FREE, output=regions)
    own_regions = np.unique(regions[reached])

    least_m = goals.least_frontier_m(grid.frame.resolution_m)

    def reason_for(frontier: Frontier) -> tuple[Reason, str]:
        size_m = frontier.size * grid.frame.resolution_m
        if size_m < least_m:
            least = f"shorter than the {least_m:.2f} m worth a look"
            return Reason.SPECK, f"{size_m:.2f} m long, {least}"
        if not np.isin(regions[frontier.cells[:, 1], frontier.cells[:, 0]], own_regions).any():
            return Reason.SEALED, "no free space leads to it"
        if any(frontier is other for other in unvisited):
            if is_early:
                return Reason.UNVISITED, "in reach and worth a look, but the run ended first"
            promise = f"promises less than {goals.worth_gain_m2:.2f} m²"
            return Reason.SPECK, f"{size_m:.2f} m long, {promise}: not worth the way"
        failed = looks.at(frontier, grid)
        away_m = _distance_m(frontier, grid, reached)
        if failed and away_m < body_radius_m + 2.0 * grid.frame.resolution_m:
            return failed[-1].reason, f"{len(failed)} tries: {failed[-1].why}"
        body = f"a body {2.0 * body_radius_m:.2f} m wide"
        return Reason.TOO_NARROW, f"{body} comes no nearer than {min(away_m, FAR_M):.2f} m"

    def left(frontier: Frontier, reason: Reason, why: str) -> UnknownLeft:
        return UnknownLeft(frontier.centroid_in_map, frontier.size * grid.frame.resolution_m, reason, why)

    def reason_for_slit(mouth: Frontier) -> tuple[Reason, str]:
        size_m = mouth.size * grid.frame.resolution_m
        why = f"a slit {size_m:.2f} m wide, not worth the way"
        return (Reason.TOO_NARROW if size_m < 2.0 * body_radius_m else Reason.SPECK), why

    narrow = (left(mouth, *reason_for_slit(mouth)) for mouth in slits)
    outside = (left(frontier, Reason.OUTSIDE, "beyond the boundary") for frontier in beyond)
    return (*(left(frontier, *reason_for(frontier)) for frontier in frontiers), *narrow, *outside)


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
