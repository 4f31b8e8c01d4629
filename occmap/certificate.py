"""The certificate of being done: each frontier that remains, and why it is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.decision import Reason, UnknownLeft
from occmap.grid import Belief, OccupancyGrid

if TYPE_CHECKING:
    from occmap.frontiers import Frontier
    from occmap.memory import FailedLooks
    from occmap.planner import Wavefront


def certify(
    frontiers: Sequence[Frontier],
    grid: OccupancyGrid,
    wave: Wavefront,
    looks: FailedLooks,
    min_frontier_m: float,
    nearest_look_m: float,
    body_radius_m: float,
) -> tuple[UnknownLeft, ...]:
    """The reason for every frontier, given a flood of all that the body can reach.

    Where the body cannot come as near as nearest_look_m, a gap too narrow for it is what is wrong,
    however often it has looked from farther away.
    """
    reached = np.isfinite(wave.cost_m)
    regions, _ = ndimage.label(grid.state == Belief.FREE)
    own_regions = np.unique(regions[reached])

    def reason_for(frontier: Frontier) -> UnknownLeft:
        size_m = frontier.size * grid.frame.resolution_m

        def because(reason: Reason, why: str) -> UnknownLeft:
            return UnknownLeft(frontier.centroid_in_map, size_m, reason, why)

        if size_m < min_frontier_m:
            return because(
                Reason.SPECK, f"{size_m:.2f} m long, shorter than the {min_frontier_m:.2f} m worth a look"
            )
        if not np.isin(regions[frontier.cells[:, 1], frontier.cells[:, 0]], own_regions).any():
            return because(Reason.SEALED, "no free space leads to it")
        failed = looks.at(frontier, grid)
        away_m = _distance_to_reached_m(frontier, grid, reached)
        if failed and away_m < nearest_look_m:
            return because(failed[-1].reason, f"{len(failed)} tries: {failed[-1].why}")
        return because(
            Reason.TOO_NARROW,
            f"a body {2.0 * body_radius_m:.2f} m wide comes no nearer than {away_m:.2f} m and sees no further from there",
        )

    return tuple(reason_for(frontier) for frontier in frontiers)


def _distance_to_reached_m(frontier: Frontier, grid: OccupancyGrid, reached: NDArray[np.bool_]) -> float:
    iy, ix = np.nonzero(reached)
    if not len(ix):
        return float("inf")
    x, y = frontier.cells[len(frontier.cells) // 2]
    return float(np.sqrt(((ix - x) ** 2 + (iy - y) ** 2).min())) * grid.frame.resolution_m
