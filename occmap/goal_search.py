"""The search for the next goal: the nearer ways first, the hopeless frontiers last."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from occmap.boundary import Boundary
from occmap.frontiers import Frontier, near_to
from occmap.geometry import Pose2
from occmap.goals import SAME_GOAL_M, Goal, GoalChooser, best_of
from occmap.hopeless import Hopeless, Leftovers
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.nooks import Nooks
from occmap.slices import Sliced
from occmap.strategies import is_by_cost_alone
from occmap.tour import Stop, Tour
from occmap.views import LOOK_CELLS, Views

if TYPE_CHECKING:
    from occmap.grid import OccupancyGrid
    from occmap.planner import Wavefront

Flood = Callable[[float], Generator[int, None, "Wavefront"]]
"""A wavefront from where the robot stands over all that costs at most so many metres."""

BOUNDS_M = (4.0, 16.0, 32.0, 64.0, 128.0)
"""How far a flood goes, step by step: most goals are near, and a flood costs what it covers."""

NEAR_M = 5.0
"""No viewpoint is farther from the middle of its frontier: half a frontier's extent and the look."""
TOUR_CELLS = 3_000_000
"""On a larger map the nearest frontier is sought: a tour looks at all of the map, and at all that is left."""
NEWS_M = 32.0
"""What becomes known on the way to a goal is no farther from the robot."""
LARGE_CELLS = 1_000_000
"""From so many cells in reach on it pays to remember where there was nothing to look at."""
DETOURS = (1.3, 3.0)
"""By these factors a way may cost more than on a coarse map: usually, and along walls all the way."""


@dataclass(frozen=True)
class FoundGoals:
    """What a search found: the goal to pursue, if any, all its rivals, and the flood that reached them."""

    best: Goal | None
    goals: tuple[Goal, ...]
    wave: Wavefront


@dataclass(frozen=True, eq=False)
class _Query:
    """What a goal is sought in, and what the robot is after meanwhile."""

    frontiers: Sequence[Frontier]
    grid: OccupancyGrid
    flood: Flood
    pursued: Goal | None
    way_left_m: float


class GoalSearch:
    """Looks for viewpoints in widening floods, and only when there is none near a frontier, from afar."""

    def __init__(self, chooser: GoalChooser, looks: FailedLooks, boundary: Boundary | None = None) -> None:
        self.chooser = chooser
        self.looks = looks
        self.looked_at = LookedAt()
        self._views = Views(chooser, looks, self.looked_at)
        self._nooks = Nooks(chooser, looks, self.looked_at, boundary)
        self._leftovers: Leftovers | None = None
        self._hopeless = Hopeless()
        self._tour = Tour(chooser.config.tour) if chooser.config.strategy == "tour" else None

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self.looks.carry_over(new_map_from_old_map)
        self.looked_at.carry_over(new_map_from_old_map)

    def set_out(self, goal: Goal, grid: OccupancyGrid) -> None:
        """Take in that the robot drives to another goal."""
        self.looked_at.set_out(goal, grid, is_far=goal.cost_m > self.chooser.config.worth_way_m)

    def run(
        self,
        frontiers: Sequence[Frontier],
        grid: OccupancyGrid,
        flood: Flood,
        pursued: Goal | None = None,
        way_left_m: float = 0.0,
    ) -> Sliced[FoundGoals]:
        """The goal worth most, or the one pursued where that is not much better.

        way_left_m: of the path to the goal pursued, if there is one that holds. The flood covers no more
        than it must. Without a goal it is over a flood of all that can be reached.
        """
        query = _Query(frontiers, grid, flood, pursued, way_left_m)
        found = yield from self._among_leftovers(query)
        if found is not None:
            return found
        tour = self._tour if grid.state.size <= TOUR_CELLS else None
        look = self._widening if tour is None else partial(self._along_tour, tour)
        goals, wave = yield from look(query)
        if pursued is not None and pursued.is_nook and 0.0 < way_left_m < _cheapest_m(goals):
            return FoundGoals(pursued, (pursued,), wave)  # nooks come last, but not once it is nearly there
        if not goals:
            left = list(self._views.worth_a_look(frontiers, grid))
            goals = yield from self._views.from_afar(left, grid, wave)
        if not goals:
            edges = yield from self._nooks.edges(grid)
            nooks = yield from self._nooks.goals(edges, grid, wave)
            goals = self._views.worthy(nooks, grid, wave)
            if wave.n_reached > LARGE_CELLS:
                self._leftovers = Leftovers({id(each): each for each in frontiers}, edges, grid.state)
        return FoundGoals(self._prefer(goals, pursued), tuple(goals), wave)

    def _among_leftovers(self, query: _Query) -> Sliced[FoundGoals | None]:
        """A goal near the end of a large building: at frontiers new since all were hopeless, or at nooks.

        To look at all of it again for each of its last nooks would take as long as the rest. None if there
        is no goal like that, or it is time to look at all again.
        """
        left, grid, pursued = self._leftovers, query.grid, query.pursued
        if left is None or left.trust == 0 or left.state is not grid.state:
            self._leftovers = None
            return None
        left.trust -= 1
        new = [frontier for frontier in query.frontiers if id(frontier) not in left.hopeless]
        for bound_m in BOUNDS_M:
            wave = yield from query.flood(bound_m)
            near = near_to(wave.start_in_map, new, bound_m + NEAR_M)
            goals = yield from self._views.from_near(self._views.worth_a_look(near, grid), grid, wave)
            if not goals:
                mouths = near_to(wave.start_in_map, left.edges, bound_m + self.chooser.sight_m)
                nooks = yield from self._nooks.goals(mouths, grid, wave)
                goals = self._views.worthy(nooks, grid, wave)
            if pursued is not None and self._stays_best(bound_m, goals, wave, query.way_left_m):
                return FoundGoals(pursued, (pursued,), wave)
            if goals and not self._may_widening_help(bound_m, goals, pursued):
                return FoundGoals(self._prefer(goals, pursued), tuple(goals), wave)
        return None

    def unvisited(
        self, frontiers: Sequence[Frontier], grid: OccupancyGrid, wave: Wavefront
    ) -> Sliced[list[Frontier]]:
        """The frontiers that could still be looked into, worth it or not, given a flood of all in reach."""
        views, found = self._views, []
        for frontier, failed in views.worth_a_look(frontiers, grid):
            has_place = views.has_place(frontier, failed, grid, wave)
            if has_place or views.is_seen_from_afar(frontier, failed, grid, wave):
                found.append(frontier)
            yield LOOK_CELLS + self.chooser.spent()
        return found

    def slits_left(self, grid: OccupancyGrid, wave: Wavefront) -> Sliced[list[Frontier]]:
        """The mouths of slits along walls that nobody has looked into: not worth the way, or too narrow."""
        return self._nooks.slits(grid, wave)

    def _prefer(self, goals: Sequence[Goal], pursued: Goal | None) -> Goal | None:
        """The best goal, but for hysteresis."""
        best = best_of(goals)
        if best is None or pursued is None:
            return best
        same = self.chooser.successor(pursued, goals)
        is_much_better = same is None or best.utility >= same.utility + self.chooser.config.hysteresis_m
        return best if is_much_better else same

    def _along_tour(self, tour: Tour, query: _Query) -> Sliced[tuple[list[Goal], Wavefront]]:
        """Goals at the first stop of a tour that has any; what no tour gets to is sought as without one."""
        grid = query.grid
        wave = yield from query.flood(BOUNDS_M[0])
        hopeless = self._hopeless.among(query.frontiers, grid)
        worth_a_look = self._views.worth_a_look(query.frontiers, grid)
        candidates = [(each, failed) for each, failed in worth_a_look if id(each) not in hopeless]
        heading = _nearest_to(query.pursued, candidates)
        sights = [self.chooser.sight_of(each, grid, failed) for each, failed in candidates]
        stops = tour.stops(sights, wave.terrain, wave.start_cell, heading)
        yield grid.state.size // 4
        for stop in stops:
            found = yield from self._at_stop(stop, [candidates[k] for k in stop.members], grid, query.flood)
            if found is not None:
                return found
        return (yield from self._widening(query))

    def _at_stop(
        self, stop: Stop, members: Sequence[tuple[Frontier, int]], grid: OccupancyGrid, flood: Flood
    ) -> Sliced[tuple[list[Goal], Wavefront] | None]:
        """Goals at a stop of a tour that are worth the way; what there is no place for is hopeless."""
        views = self._views
        for detour in DETOURS:
            wave = yield from flood(max(BOUNDS_M[0], detour * stop.cost_m + NEAR_M))
            goals = views.from_lookout(stop, members, grid, wave)
            goals = goals or (yield from views.from_near(members, grid, wave))
            if goals:
                return goals, wave
            if any(views.has_place(each, failed, grid, wave) for each, failed in members):
                return None
        for frontier, _ in members:
            self._hopeless.note(frontier, grid)
        return None

    def _widening(self, query: _Query) -> Sliced[tuple[list[Goal], Wavefront]]:
        """Goals seen from near, and the flood that reached them: as narrow a one as proves the best."""
        grid, pursued = query.grid, query.pursued
        for bound_m in (*BOUNDS_M, math.inf):
            wave = yield from query.flood(bound_m)
            near = near_to(wave.start_in_map, query.frontiers, bound_m + NEAR_M)
            goals = yield from self._views.from_near(self._views.worth_a_look(near, grid), grid, wave)
            if pursued is not None and self._stays_best(bound_m, goals, wave, query.way_left_m):
                return [pursued], wave
            if wave.is_exhausted or not self._may_widening_help(bound_m, goals, pursued):
                return goals, wave
        raise AssertionError("a flood without bound is exhausted")

    def _stays_best(self, bound_m: float, goals: Sequence[Goal], wave: Wavefront, way_left_m: float) -> bool:
        """Whether a goal beyond the bound is nearest still: the robot drives to it, and news are near."""
        is_far = NEWS_M <= bound_m < way_left_m and not wave.is_exhausted
        return is_far and not goals and is_by_cost_alone(self.chooser.config.strategy)

    def _may_widening_help(self, bound_m: float, goals: Sequence[Goal], pursued: Goal | None) -> bool:
        """Whether beyond the bound may lie what is better, or the pursued goal and hardly worse."""
        best = best_of(goals)
        if best is None:
            return True
        is_missing = pursued is not None and self.chooser.successor(pursued, goals) is None
        slack_m = self.chooser.config.hysteresis_m if is_missing else 0.0
        return self.chooser.may_be_beaten_beyond(bound_m, best.utility - slack_m)


def _cheapest_m(goals: Sequence[Goal]) -> float:
    return min((goal.cost_m for goal in goals), default=0.0)


def _nearest_to(goal: Goal | None, candidates: Sequence[tuple[Frontier, int]]) -> int | None:
    """The index of the frontier that a goal's has become, if it is still there."""
    if goal is None or not candidates:
        return None
    away_m = [math.dist(goal.frontier.centroid_in_map, each.centroid_in_map) for each, _ in candidates]
    nearest = min(range(len(away_m)), key=away_m.__getitem__)
    return nearest if away_m[nearest] < SAME_GOAL_M else None
