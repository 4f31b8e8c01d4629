"""Where to look next: which frontier, and from which viewpoint."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier
from occmap.geometry import Points, Pose2
from occmap.grid import OccupancyGrid
from occmap.strategies import Strategy, is_by_cost_alone, worth
from occmap.tour import TourConfig

if TYPE_CHECKING:
    from occmap.planner import Wavefront

SAME_GOAL_M = 1.0
"""Goals whose frontiers lie no farther apart are taken for one, seen at two times."""

GONE_SHARE = 0.25
"""With less than this of its frontier left, a goal is gone."""

TARGETS = 6
"""A frontier is sampled at so many places to tell what is seen of it."""
SEEN_SHARE = 0.5
"""A look at less of a frontier only moves its end on a little."""
NOOK_DEPTH_M = 0.35
"""A nook is at least this deep."""

NEVER_NEGATIVE = (
    *("gain_range_m", "min_frontier_m", "min_far_frontier_m", "min_nook_m"),
    *("worth_way_m", "worth_gain_m2", "hysteresis_m"),
)
LONG_M = 0.5
"""A frontier as long as this promises enough for any way."""

SPECK_M = 0.35
"""What is longer is no speck, however coarse the cells; the robot is as wide."""


COARSE_M = 0.075
"""From here on two cells of a wall's rim in a row say nothing."""


@dataclass(frozen=True)
class GoalConfig:
    """How the explorer values what it could look at."""

    strategy: Strategy = "tour"
    """nearest: the frontier with the shortest way to it. utility: lambda * gain - cost. gain_per_cost and
    gain_decay: gain / cost and gain * exp(-cost / 10 m). tour: the first on the best way through all."""
    lambda_m_per_m2: float = 1.0
    """Metres the robot would drive to see one more square metre (strategy utility)."""
    gain: Literal["raycast", "size"] = "raycast"
    """raycast: unknown area that a look from the viewpoint is expected to reveal. size: cheaper,
    the frontier's length times a depth of 1 m."""
    gain_range_m: float = 4.0
    """How far an expected look reaches: nobody knows where the walls behind a frontier are."""
    look_from_m: tuple[float, ...] = (2.5, 1.2, 0.5)
    """A viewpoint lies at most this far from its frontier; each look that fails goes nearer."""
    look_into_m: tuple[float, ...] = (1.0, 0.5, 0.25)
    """Those looks are aimed this deep into the unknown: what grazes a frontier only moves it on a little."""
    min_frontier_m: float = 0.2
    """A shorter frontier is a speck: no gap that the body fits through is this narrow."""
    min_far_frontier_m: float = 0.5
    """One that can only be seen from farther away than any usual look must be this long."""
    min_nook_m: float = 0.1
    """When nothing else is left, edges of the unknown along walls get one look if they are this long."""
    worth_way_m: float = 10.0
    """A way longer than this must promise something:"""
    worth_gain_m2: float = 0.1
    """so much unknown area, somewhat more than the robot stands on. What hides less is seen in passing."""
    hysteresis_m: float = 1.0
    """Another goal must be better by this much before a good one is abandoned for it."""
    tour: TourConfig = field(default_factory=TourConfig)

    def __post_init__(self) -> None:
        if self.strategy not in get_args(Strategy):
            raise ValueError(
                f"unknown strategy {self.strategy!r}: choose from {', '.join(get_args(Strategy))}"
            )
        if self.gain not in ("raycast", "size"):
            raise ValueError(f"gain must be raycast or size, got {self.gain!r}")
        if not (math.isfinite(self.lambda_m_per_m2) and self.lambda_m_per_m2 >= 0.0):
            raise ValueError(f"lambda must not be negative, got {self.lambda_m_per_m2}")
        for name in NEVER_NEGATIVE:
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} must not be negative, got {getattr(self, name)}")
        looks_m = (*self.look_from_m, *self.look_into_m)
        if not looks_m or not all(math.isfinite(value) and value > 0.0 for value in looks_m):
            raise ValueError(f"looks need positive distances, got {self.look_from_m} and {self.look_into_m}")
        if len(self.look_from_m) != len(self.look_into_m):
            raise ValueError(
                f"look_from_m and look_into_m must pair up, got {self.look_from_m} and {self.look_into_m}"
            )

    def least_frontier_m(self, resolution_m: float) -> float:
        """What is shorter is a speck; so are up to three coarse cells, such as the corners of walls make."""
        return max(self.min_frontier_m, min(4.0 * resolution_m, SPECK_M))

    def least_nook_m(self, resolution_m: float) -> float:
        """The same for edges along walls."""
        cells = 2.0 if resolution_m < COARSE_M else 3.0  # walls askew cut the corners of coarse cells
        return max(self.min_nook_m, min(cells * resolution_m, SPECK_M))


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
    is_nook: bool = False
    """Its frontier runs along walls: what the frontier map leaves out as a rim."""

    def distance_m(self, other: Goal) -> float:
        """Between the centroids of the two frontiers."""
        (x, y), (other_x, other_y) = self.frontier.centroid_in_map, other.frontier.centroid_in_map
        return math.hypot(x - other_x, y - other_y)

    def carried(self, new_map_from_old_map: Pose2) -> Goal:
        """The same goal after a correction of the map."""
        old = np.array([self.viewpoint_in_map, self.frontier.centroid_in_map])
        viewpoint, centroid = ((float(x), float(y)) for x, y in new_map_from_old_map.apply(old))
        return replace(
            self,
            viewpoint_in_map=viewpoint,
            frontier=replace(self.frontier, viewpoint=viewpoint, centroid_in_map=centroid),
            watched_in_map=new_map_from_old_map.apply(self.watched_in_map),
        )

    def __str__(self) -> str:
        gain = "" if math.isnan(self.gain_m2) else f"gain {self.gain_m2:.2f} m², "
        x, y = self.frontier.centroid_in_map
        return f"frontier at ({x:.1f}, {y:.1f}): {gain}cost {self.cost_m:.1f} m, U = {self.utility:.2f}"


class GoalChooser:
    """Finds a viewpoint for each frontier and says which is worth most. Remembers nothing."""

    def __init__(self, config: GoalConfig) -> None:
        from occmap import goals_kernels

        self.config = config
        self.looks = tuple(zip(config.look_from_m, config.look_into_m, strict=True))
        """(from_m, into_m), the widest first."""
        self._kernels = goals_kernels

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
        least one of the places that sample it.

        The viewpoint sees unknown cells beyond the frontier, not merely the frontier: an edge of a
        pillar's shadow is in plain sight from where the shadow was cast, and looking at it from
        there again shows nothing new.
        """
        deepest = max(1, round(into_m / grid.frame.resolution_m))
        targets = self._kernels.unknown_beyond(grid.state, frontier.cells, TARGETS, deepest)
        return self._goal_seeing(targets, frontier, grid, wave, from_m + into_m, stride, within_m, share)

    def _goal_seeing(
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
        """A goal at the cheapest place that sees targets (n, 3), x, y and depth, from at most reach_m."""
        if not len(targets):
            return None
        reach = max(1, int(reach_m / grid.frame.resolution_m))
        cost, below = wave.fixed_point(within_m)
        needed = max(1, math.ceil(share * len(targets)))
        ix, iy = self._kernels.find_viewpoint(grid.state, cost, below, targets, needed, reach, stride)
        if ix < 0:
            return None
        cost_m = wave.metres(cost[iy, ix])
        gain_m2 = self._gain_m2(frontier, grid, ix, iy)
        watched = frontier.cells[:: max(1, len(frontier.cells) // 24)]
        viewpoint = grid.frame.centre_of(ix, iy)
        return Goal(
            frontier=replace(frontier, viewpoint=viewpoint),
            viewpoint_in_map=viewpoint,
            cost_m=cost_m,
            gain_m2=gain_m2,
            utility=self._worth(gain_m2, cost_m),
            watched_in_map=grid.frame.map_from_cell(watched),
        )

    def may_be_nook(self, edge: Frontier, grid: OccupancyGrid) -> bool:
        """Whether an edge along walls is long enough to be the mouth of a slit."""
        r = grid.frame.resolution_m
        return edge.size * r >= self.config.least_nook_m(r)

    def goal_into_nook(
        self, mouth: Frontier, grid: OccupancyGrid, wave: Wavefront, from_m: float
    ) -> Goal | None:
        """The same for a slit between obstacles: as deep a look as there is a place for.

        A slit is told from a wall's cells that flicker by its depth, by several lines that lead into it,
        and by no beam ever having got there.
        """
        if not self.may_be_nook(mouth, grid):
            return None
        r = grid.frame.resolution_m
        for into_m in self.config.look_into_m:
            deepest = max(1, round(into_m / r))
            least = max(1, round(max(0.5 * into_m, NOOK_DEPTH_M) / r))
            inside = self._kernels.unknown_inside(grid.state, mouth.cells, least, deepest)
            belief = grid.log_odds[inside[:, 1], inside[:, 0]]
            untouched = inside[np.abs(belief - grid.prior_log_odds) < 0.1]
            if len(untouched) < TARGETS:
                continue
            sample = untouched[:: len(untouched) // TARGETS].copy()
            for share in (SEEN_SHARE, 0.0):
                goal = self._goal_seeing(sample, mouth, grid, wave, from_m + into_m, share=share)
                if goal is not None:
                    depth_cells = float(np.median(sample[:, 2]))
                    return replace(goal, is_nook=True, gain_m2=mouth.size * depth_cells * r * r)
        return None

    def is_worth_the_way(self, goal: Goal, grid: OccupancyGrid) -> bool:
        """Whether a goal is near, or promises to show something: a small leftover far away does not."""
        c, r = self.config, grid.frame.resolution_m
        if goal.cost_m <= c.worth_way_m:
            return True
        if goal.is_nook:
            return goal.gain_m2 >= c.worth_gain_m2
        if goal.frontier.size * r >= LONG_M:
            return True
        ix, iy = grid.frame.cell_at(*goal.viewpoint_in_map)
        return self._in_sight_m2(grid, ix, iy) >= c.worth_gain_m2

    def _gain_m2(self, frontier: Frontier, grid: OccupancyGrid, ix: int, iy: int) -> float:
        r = grid.frame.resolution_m
        if is_by_cost_alone(self.config.strategy):
            return math.nan
        if self.config.gain == "size":
            return frontier.size * r * 1.0
        return self._in_sight_m2(grid, ix, iy)

    def _in_sight_m2(self, grid: OccupancyGrid, ix: int, iy: int) -> float:
        """Unknown area that a look from a cell is expected to reveal."""
        r = grid.frame.resolution_m
        reach = int(self.config.gain_range_m / r)
        return self._kernels.expected_gain_cells(grid.state, ix, iy, reach, 96) * r * r

    def affordable_m(self, best: Goal | None) -> float:
        """What a goal may cost at most to be worth comparing with the best so far."""
        if best is None or not is_by_cost_alone(self.config.strategy):
            return math.inf
        return best.cost_m + self.config.hysteresis_m

    def may_be_beaten_beyond(self, bound_m: float, utility_m: float) -> bool:
        """Whether a goal that costs more than bound_m could be worth more than this."""
        return self._worth(math.pi * self.config.gain_range_m**2, bound_m) > utility_m

    def _worth(self, gain_m2: float, cost_m: float) -> float:
        return worth(self.config.strategy, gain_m2, cost_m, self.config.lambda_m_per_m2)

    def is_gone(self, goal: Goal, grid: OccupancyGrid, frontier_mask: np.ndarray) -> bool:
        """True once next to nothing of the goal's frontier is left within 0.3 m of where it was."""
        cells = grid.frame.cell_from_map(goal.watched_in_map)
        if goal.is_nook:
            return self._kernels.share_beside_unknown(grid.state, cells) < GONE_SHARE
        radius = max(1, round(0.3 / grid.frame.resolution_m))
        return self._kernels.share_with_neighbour(frontier_mask, cells, radius) < GONE_SHARE

    def successor(self, goal: Goal, goals: Sequence[Goal]) -> Goal | None:
        """What has become of a goal since: the nearest among the new ones, if it is near."""
        nearest = min(goals, key=goal.distance_m, default=None)
        return nearest if nearest is not None and goal.distance_m(nearest) < SAME_GOAL_M else None


def best_of(goals: Iterable[Goal]) -> Goal | None:
    """The goal of the highest utility; the first of equals, so that runs repeat exactly."""
    return max(goals, key=lambda goal: goal.utility, default=None)
