"""Drawn beliefs to choose goals in."""

from __future__ import annotations

import math

import numpy as np

from occmap.body import Body
from occmap.clearance import ClearanceMap
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.goal_config import GoalConfig
from occmap.goals import Goal, GoalChooser
from occmap.planner import Planner, PlannerConfig
from tests.ascii_maps import ascii_grid

SMALL_BODY = Body(radius_m=0.05)
NO_MARGINS = PlannerConfig(
    comfortable_margin_m=0.02,
    keep_margin_m=0.01,
    tight_margin_m=0.0,
    roomy_margin_m=0.03,
    wall_weight=1.0,
    tight_weight=1.0,
)
"""So small, and so careless, that in a picture of 0.25 m cells the cost of a way is its length."""


class Scene:
    """A drawn belief with all that choosing a goal needs."""

    def __init__(self, picture, start=(1, 1), *, resolution_m=0.25, config=None, body=SMALL_BODY):
        self.grid = ascii_grid(picture, resolution_m)
        self.clearance = ClearanceMap()
        self.clearance.rebuild(self.grid)
        self.edges = FrontierMap(FrontierConfig(ignore_rim=False))
        self.edges.rebuild(self.grid)
        self.frontiers = self.edges.clusters(self.grid)
        self.planner, self.start = Planner(NO_MARGINS, body) if body else Planner(), start
        self.chooser = GoalChooser(config or GoalConfig())

    def flood(self, within_m=math.inf):
        return self.planner.flood(self.grid, self.clearance.distance_m, self.start, within_m=within_m)

    def goal(self, frontier=None, from_m=2.5, into_m=0.5):
        frontier = frontier or self.frontiers[0]
        return self.chooser.goal_for(frontier, self.grid, self.flood(), from_m, into_m, stride=1)


def goal_at(x, y, **values):
    frontier = Frontier(np.array([[0, 0]]), (x, y), 1)
    values = {"cost_m": 1.0, "gain_m2": math.nan, "utility": 0.0, **values}
    return Goal(frontier, (x, y), watched_in_map=np.array([[x, y]]), **values)
