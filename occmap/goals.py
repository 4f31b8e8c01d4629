"""Where to look next: which frontier, and from which viewpoint."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier
from occmap.geometry import Points, Pose2
from occmap.goal_config import GoalConfig
from occmap.grid import OccupancyGrid
from occmap.lookouts import SEEN_SHARE, Sight
from occmap.strategies import is_by_cost_alone, worth

if TYPE_CHECKING:
    from occmap.planner import Wavefront

SAME_GOAL_M = 1.0
"""Goals whose frontiers lie no farther apart are taken for one, seen at two times."""

GONE_SHARE = 0.25
"""With less than this of its frontier left, a goal is gone,"""
GONE_WITHIN_M = 0.3
"""and as much is left as has some frontier within this: edges move while the robot looks at them."""
GAIN_RAYS = 96
"""Cast all around to tell what a look would reveal: one in 4 degrees, 20 cm apart at 3 m."""
SIZE_DEPTH_M = 1.0
"""Where gain is by size, a frontier's length stands for an area so deep."""

TARGETS = 6
"""A frontier is sampled at so many places to tell what is seen of it."""
WATCHED = 24
"""And at so many or a few more to tell when it is gone."""
CHEAPER = 20
"""So many cells are looked at in the time that a flood takes for one: 2 to 3 ns each."""
LONG_M = 0.5
"""A frontier as long as this promises enough for any way."""
STOPS_SHORT_M = 0.1
"""So far before its viewpoint the robot may stop, and what it was to see must be within its lidar's range."""
SHORT_INTO = 0.4
"""One that is shorter is looked into deeper: by this share of what a viewpoint may be away."""


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """A frontier to look into, from a place where the body can stand."""

    frontier: Frontier
    viewpoint_in_map: tuple[float, float]
    cost_m: float
    """The way there, metres near walls counted dearer (see Planner)."""
    gain_m2: float
    """nan where the strategy did not ask for it; of a nook, its mouth times the depth looked at."""
    utility: float
    watched_in_map: Points
    """(k, 2) places on the frontier; when none is frontier any more, the goal is gone."""
    also_watched_in_map: tuple[Points, ...] = ()
    """The same for other frontiers that the same look is to show."""
    is_nook: bool = False
    """Its frontier runs along walls: what the frontier map leaves out as a rim."""

    def distance_m(self, other: Goal) -> float:
        """Metres between the centroids of the two frontiers."""
        (x, y), (other_x, other_y) = self.frontier.centroid_in_map, other.frontier.centroid_in_map
        return math.hypot(x - other_x, y - other_y)

    def carried(self, new_map_from_old_map: Pose2) -> Goal:
        """The same goal after a correction of the map."""
        old = np.array([self.viewpoint_in_map, self.frontier.centroid_in_map])
        viewpoint, centroid = ((float(x), float(y)) for x, y in new_map_from_old_map.apply(old))
        return replace(
            self,
            viewpoint_in_map=viewpoint,
            frontier=replace(self.frontier, centroid_in_map=centroid),
            watched_in_map=new_map_from_old_map.apply(self.watched_in_map),
            also_watched_in_map=tuple(map(new_map_from_old_map.apply, self.also_watched_in_map)),
        )

    def __str__(self) -> str:
        x, y = self.frontier.centroid_in_map
        words = [f"cost {self.cost_m:.1f} m"]
        if not math.isnan(self.gain_m2):  # else its worth is its cost
            words = [f"gain {self.gain_m2:.2f} m²", *words, f"U = {self.utility:.2f}"]
        return f"frontier at ({x:.1f}, {y:.1f}): {', '.join(words)}"


class GoalChooser:
    """Finds a viewpoint for each frontier and says which is worth most.

    Remembers only what that has cost, and how far the robot sees.
    """

    def __init__(self, config: GoalConfig) -> None:
        from occmap import goals_kernels

        self.config = config
        self._looks = tuple(zip(config.look_from_m, config.look_into_m, strict=True))
        self._short_looks = tuple(
            (from_m, max(from_m * SHORT_INTO, into_m)) for from_m, into_m in self._looks
        )
        self._kernels = goals_kernels
        self._looked_at_cells = 0
        self.sight_m = math.inf
        """How far the robot sees, to be set before anything is sought: nothing is looked at from farther."""

    def spent(self) -> int:
        """Cost of seeking viewpoints since this was asked last: see slices.Sliced."""
        cells, self._looked_at_cells = self._looked_at_cells, 0
        return cells // CHEAPER

    def goal_for(
        self,
        frontier: Frontier,
        grid: OccupancyGrid,
        wave: Wavefront,
        from_m: float,
        into_m: float,
        stride: int = 2,
        within_m: float = math.inf,
        share: float = SEEN_SHARE,
    ) -> Goal | None:
        """The cheapest way to look into_m deep into a frontier from at most from_m before it, if any.

        None too if that would cost more than within_m. The look must see this share of the frontier, at
        least one of the places that sample it; from so near that a part of a long frontier is all that can
        be seen, as much less of it.

        The viewpoint sees unknown cells beyond the frontier, not merely the frontier: an edge of a
        pillar's shadow is in plain sight from where the shadow was cast, and looking at it from
        there again shows nothing new.
        """
        targets, reach_m = self._targets(frontier, grid, into_m), self._within_sight_m(from_m + into_m)
        is_near = from_m < self._looks[0][0] or reach_m < from_m + into_m
        if is_near:  # others have failed, or cannot be had: another half of it may be in nobody's reach
            share *= min(1.0, reach_m / (frontier.size * grid.frame.resolution_m))
        return self.goal_seeing(targets, frontier, grid, wave, reach_m, stride, within_m, share)

    def _within_sight_m(self, reach_m: float) -> float:
        return min(reach_m, self.sight_m - STOPS_SHORT_M)

    def _targets(self, frontier: Frontier, grid: OccupancyGrid, into_m: float) -> NDArray[np.int64]:
        deepest = max(1, round(into_m / grid.frame.resolution_m))
        return self._kernels.unknown_beyond(grid.state, frontier.cells, TARGETS, deepest)

    def looks_at(self, frontier: Frontier, grid: OccupancyGrid) -> tuple[tuple[float, float], ...]:
        """Looks (from_m, into_m), the widest first. What is short must open onto something: dents do not."""
        is_long = frontier.size * grid.frame.resolution_m >= LONG_M
        return self._looks if is_long else self._short_looks

    def sight_of(self, frontier: Frontier, grid: OccupancyGrid, failed: int) -> Sight:
        """The sight that a look at a frontier is to have, after so many that failed."""
        from_m, into_m = self.looks_at(frontier, grid)[failed]
        reach_cells = max(1, int(self._within_sight_m(from_m + into_m) / grid.frame.resolution_m))
        return Sight(frontier, self._targets(frontier, grid, into_m), reach_cells)

    def goal_at(
        self, viewpoint: tuple[int, int], frontiers: Sequence[Frontier], grid: OccupancyGrid, wave: Wavefront
    ) -> Goal | None:
        """A look at several frontiers at once from a cell (ix, iy); None if the flood does not get there."""
        cost_m = float(wave.cost_at(np.array([viewpoint]))[0])
        if math.isinf(cost_m):
            return None
        first, *others = frontiers
        goal = self._goal(first, grid, viewpoint, cost_m)
        return replace(goal, also_watched_in_map=tuple(_watched(each, grid) for each in others))

    def goal_seeing(
        self,
        targets: NDArray[np.int64],
        frontier: Frontier,
        grid: OccupancyGrid,
        wave: Wavefront,
        reach_m: float,
        stride: int = 2,
        within_m: float = math.inf,
        share: float = SEEN_SHARE,
    ) -> Goal | None:
        """A goal at the cheapest place that sees targets (n, 5) from at most reach_m, as far as one sees."""
        if not len(targets):
            return None
        reach = max(1, int(self._within_sight_m(reach_m) / grid.frame.resolution_m))
        cost, below = wave.raw_costs(within_m)
        needed = max(1, math.ceil(share * len(targets)))
        ix, iy, n = self._kernels.find_viewpoint(grid.state, cost, below, targets, needed, reach, stride)
        self._looked_at_cells += n
        if ix < 0:
            return None
        return self._goal(frontier, grid, (ix, iy), wave.metres(cost[iy, ix]))

    def _goal(self, frontier: Frontier, grid: OccupancyGrid, cell: tuple[int, int], cost_m: float) -> Goal:
        gain_m2 = self._gain_m2(frontier, grid, *cell)
        viewpoint = grid.frame.centre_of(*cell)
        return Goal(
            frontier=frontier,
            viewpoint_in_map=viewpoint,
            cost_m=cost_m,
            gain_m2=gain_m2,
            utility=self._worth(gain_m2, cost_m),
            watched_in_map=_watched(frontier, grid),
        )

    def _gain_m2(self, frontier: Frontier, grid: OccupancyGrid, ix: int, iy: int) -> float:
        r = grid.frame.resolution_m
        if is_by_cost_alone(self.config.strategy):
            return math.nan
        if self.config.gain == "size":
            return frontier.size * r * SIZE_DEPTH_M
        return self.in_sight_m2(grid, ix, iy)

    def in_sight_m2(self, grid: OccupancyGrid, ix: int, iy: int) -> float:
        """Unknown area that a look from a cell is expected to reveal."""
        r = grid.frame.resolution_m
        reach = int(self._gain_range_m / r)
        return self._kernels.expected_gain_cells(grid.state, ix, iy, reach, GAIN_RAYS) * r * r

    @property
    def _gain_range_m(self) -> float:
        """How far an expected look reaches."""
        return min(self.config.gain_range_m, self.sight_m)

    def affordable_m(self, best: Goal | None) -> float:
        """The most that a goal may cost to be worth comparing with the best so far."""
        if best is None or not is_by_cost_alone(self.config.strategy):
            return math.inf
        return best.cost_m + self.config.hysteresis_m

    def may_be_beaten_beyond(self, bound_m: float, utility_m: float) -> bool:
        """Whether a goal that costs more than bound_m could be worth more than this."""
        return self._worth(math.pi * self._gain_range_m**2, bound_m) > utility_m

    def _worth(self, gain_m2: float, cost_m: float) -> float:
        return worth(self.config.strategy, gain_m2, cost_m, self.config.lambda_m_per_m2)

    def is_gone(self, goal: Goal, grid: OccupancyGrid, frontier_mask: np.ndarray) -> bool:
        """Whether next to nothing of the goal's frontier is left near where it was."""
        cells = grid.frame.cell_from_map(np.concatenate((goal.watched_in_map, *goal.also_watched_in_map)))
        if goal.is_nook:
            return self._kernels.share_beside_unknown(grid.state, cells) < GONE_SHARE
        radius = max(1, round(GONE_WITHIN_M / grid.frame.resolution_m))
        return self._kernels.share_with_neighbour(frontier_mask, cells, radius) < GONE_SHARE

    def successor(self, goal: Goal, goals: Sequence[Goal]) -> Goal | None:
        """The goal that another has become since: the nearest among the new ones, if it is near."""
        nearest = min(goals, key=goal.distance_m, default=None)
        return nearest if nearest is not None and goal.distance_m(nearest) < SAME_GOAL_M else None


def _watched(frontier: Frontier, grid: OccupancyGrid) -> Points:
    """(k, 2) places that stand for a frontier. An odd stride, for rows of two cells: not always the left."""
    return grid.frame.map_from_cell(frontier.cells[:: len(frontier.cells) // WATCHED | 1])


def best_of(goals: Iterable[Goal]) -> Goal | None:
    """The goal of the highest utility; the first of equals, so that runs repeat exactly."""
    return max(goals, key=lambda goal: goal.utility, default=None)
