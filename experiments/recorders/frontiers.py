"""Where frontiers are shown, in which colour, and which of them the robot is after."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from experiments.recorders import palette
from occmap.geometry import Points

if TYPE_CHECKING:
    from occmap.decision import Decision
    from occmap.frontiers import Frontier

SAME_FRONTIER_M = 1.0
"""No farther from where it was when the goal was set, a frontier is taken to be the same one."""


def cells_in_map(frontier: Frontier, resolution_m: float) -> Points:
    """(n, 2) the centres of a frontier's cells, in the map frame.

    Laid out around the centroid: the cells count from wherever the grid began when the frontier was
    found, and it may have grown since.
    """
    return (
        frontier.cells - np.add.reduce(frontier.cells) / len(frontier.cells)
    ) * resolution_m + frontier.centroid_in_map


def frontier_colour(frontier: Frontier) -> palette.Rgb:
    """A colour that stays with a place, not with a rank in a list that is renumbered at every scan."""
    x_m, y_m = frontier.centroid_in_map
    return palette.FRONTIERS[(math.floor(x_m / 2.0) * 3 + math.floor(y_m / 2.0) * 5) % len(palette.FRONTIERS)]


def chosen_frontier(decision: Decision) -> Frontier | None:
    """The frontier of this decision that the goal was set for.

    Matched by place: a goal keeps the frontier it was made from, which later scans nibble at.
    """
    if decision.goal is None or not decision.frontiers:
        return None
    goal_m = decision.goal.frontier.centroid_in_map
    nearest = min(decision.frontiers, key=lambda f: math.dist(f.centroid_in_map, goal_m))
    return nearest if math.dist(nearest.centroid_in_map, goal_m) <= SAME_FRONTIER_M else None
