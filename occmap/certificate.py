"""The certificate of being done: each frontier that remains, and why it is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from occmap.decision import Reason, UnknownLeft
from occmap.grid import Belief, OccupancyGrid

if TYPE_CHECKING:
    from occmap.frontiers import Frontier
    from occmap.goals import GoalConfig
    from occmap.memory import FailedLooks
    from occmap.planner import Wavefront


def certify(
    frontiers: Sequence[Frontier],
    grid: OccupancyGrid,
    wave: Wavefront,
    looks: FailedLooks,
    goals: GoalConfig,
    body_radius_m: float,
    unvisited: Sequence[Frontier] = (),
) -> tuple[UnknownLeft, ...]:
    """The reason for every frontier, given a flood of all that the body can reach.

    unvisited: those of the frontiers that could still be looked into, where the run ends early.

    Where the body cannot come up to a frontier, a gap too narrow for it is what is wrong, however often
    the robot has looked in from a distance.
    """
    reached = np.isfinite(wave.cost_m)
    regions = np.empty(grid.shape, np.int32)
    ndimage.label(grid.state == Belief.FREE, output=regions)
    own_regions = np.unique(regions[reached])
    away = np.empty(grid.shape, np.float64)  # in cells
    ndimage.distance_transform_edt(~reached, distances=away)

    def reason_for(frontier: Frontier) -> tuple[Reason, str]:
        size_m = frontier.size * grid.frame.resolution_m
        if size_m < goals.min_frontier_m:
            least = f"shorter than the {goals.min_frontier_m:.2f} m worth a look"
            return Reason.SPECK, f"{size_m:.2f} m long, {least}"
        if not np.isin(regions[frontier.cells[:, 1], frontier.cells[:, 0]], own_regions).any():
            return Reason.SEALED, "no free space leads to it"
        if any(frontier is other for other in unvisited):
            return Reason.UNVISITED, "in reach and worth a look, but the run ended first"
        failed = looks.at(frontier, grid)
        away_m = float(away[frontier.cells[:, 1], frontier.cells[:, 0]].min()) * grid.frame.resolution_m
        if failed and away_m < body_radius_m + 2.0 * grid.frame.resolution_m:
            return failed[-1].reason, f"{len(failed)} tries: {failed[-1].why}"
        body = f"a body {2.0 * body_radius_m:.2f} m wide"
        return Reason.TOO_NARROW, f"{body} comes no nearer than {away_m:.2f} m"

    return tuple(
        UnknownLeft(frontier.centroid_in_map, frontier.size * grid.frame.resolution_m, *reason_for(frontier))
        for frontier in frontiers
    )
