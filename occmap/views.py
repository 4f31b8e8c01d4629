"""Views: the looks that there is a place for, from near and from afar, as far as they are worth the way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from occmap.frontiers import Frontier
from occmap.goal_config import SPECK_M
from occmap.goals import LONG_M, Goal, GoalChooser, best_of
from occmap.grid import OccupancyGrid
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.slices import Sliced
from occmap.tour import Stop
from occmap.wavefront import Wavefront

ROOM_M2 = 3.0
"""No more is demanded of a long frontier: with this much in sight it may be a door."""
BAD_LUCK = 2
"""So many far looks in vain, one after the other, say nothing about the next."""
FAR_LOOKS = 2
"""A frontier that can only be seen from afar is given up after so many looks."""
LOOK_CELLS = 1_000
"""What a look costs beside the search for a place to look from: see slices.Sliced."""


class Views:
    """Finds viewpoints for frontiers that are worth a look, and leaves out what is not worth the way."""

    def __init__(self, chooser: GoalChooser, looks: FailedLooks, looked_at: LookedAt) -> None:
        self._chooser = chooser
        self._looks = looks
        self._looked_at = looked_at

    def worth_a_look(
        self, frontiers: Sequence[Frontier], grid: OccupancyGrid
    ) -> Iterator[tuple[Frontier, int]]:
        """Frontiers that are no specks and not yet given up, each with the number of looks that failed."""
        config, resolution_m = self._chooser.config, grid.frame.resolution_m
        least_m = config.least_frontier_m(resolution_m)
        for frontier in frontiers:
            if frontier.size * resolution_m < least_m:
                continue
            failed = len(self._looks.at(frontier, grid))
            if failed < len(config.look_from_m):
                yield frontier, failed

    def from_lookout(
        self, stop: Stop, members: Sequence[tuple[Frontier, int]], grid: OccupancyGrid, wave: Wavefront
    ) -> list[Goal]:
        """The look at all that a stop's lookout shows, if there is a way to it that is worth it."""
        if stop.lookout is None:
            return []
        together = [frontier for frontier, _ in members[: stop.in_sight]]
        return self.worthy([self._chooser.goal_at(stop.lookout, together, grid, wave)], grid, wave)

    def from_near(
        self, frontiers: Iterable[tuple[Frontier, int]], grid: OccupancyGrid, wave: Wavefront
    ) -> Sliced[list[Goal]]:
        """Looks at the frontiers, but for those that cost too much: to compete with the best, or at all.

        In the order they come, which is by the crow's distance: the best turns up early. Until there is
        one, each frontier gets every look that may help; from then on, the widest has to do.
        """
        goals: list[Goal] = []
        best: Goal | None = None
        for frontier, failed in frontiers:
            looks = self._chooser.looks_at(frontier, grid)[failed:]
            looks = looks if best is None else looks[:1]
            goal = self._first(frontier, looks, grid, wave, self._chooser.affordable_m(best))
            if goal is not None and self.is_worth_the_way(goal, grid, wave):
                goals.append(goal)
                best = best_of((best, goal)) if best is not None else goal
            yield LOOK_CELLS + self._chooser.spent()
        return goals

    def has_place(self, frontier: Frontier, failed: int, grid: OccupancyGrid, wave: Wavefront) -> bool:
        """Whether there is a place to look into a frontier from near, worth the way or not."""
        looks = self._chooser.looks_at(frontier, grid)[failed:]
        return self._first(frontier, looks, grid, wave) is not None

    def _first(
        self,
        frontier: Frontier,
        looks: Sequence[tuple[float, float]],
        grid: OccupancyGrid,
        wave: Wavefront,
        within_m: float = math.inf,
    ) -> Goal | None:
        """The first of some looks (from_m, into_m) that there is a place for."""
        for from_m, into_m in looks:
            goal = self._chooser.goal_for(frontier, grid, wave, from_m, into_m, within_m=within_m)
            if goal is not None:
                return goal
        return None

    def from_afar(
        self,
        frontiers: Sequence[tuple[Frontier, int]],
        grid: OccupancyGrid,
        wave: Wavefront,
    ) -> Sliced[list[Goal]]:
        """Goals to be seen from afar that are worth the way: from as near as there are any."""
        for from_m in self._afar_m():
            found: list[Goal | None] = []
            for frontier, failed in frontiers:
                found.append(self._from_afar(frontier, failed, grid, wave, from_m))
                yield LOOK_CELLS + self._chooser.spent()
            if worthy := self.worthy(found, grid, wave):
                return worthy
        return []

    def is_seen_from_afar(
        self, frontier: Frontier, failed: int, grid: OccupancyGrid, wave: Wavefront
    ) -> bool:
        """Whether there is a place to see a frontier from, worth the way or not."""
        places_m = self._afar_m()
        return any(self._from_afar(frontier, failed, grid, wave, from_m) is not None for from_m in places_m)

    def _afar_m(self) -> tuple[float, float, float]:
        sight_m = self._chooser.sight_m
        return self._chooser.config.look_from_m[0], 0.5 * sight_m, sight_m

    def _from_afar(
        self, frontier: Frontier, failed: int, grid: OccupancyGrid, wave: Wavefront, from_m: float
    ) -> Goal | None:
        """A look through a slot, from a narrow passage, at a part only: worth fewer tries than from near."""
        config, size_m = self._chooser.config, frontier.size * grid.frame.resolution_m
        is_far = from_m > config.look_from_m[0]
        if failed >= FAR_LOOKS or (is_far and size_m < config.min_far_frontier_m):
            return None
        into_m = config.look_into_m[-1]
        return self._chooser.goal_for(frontier, grid, wave, from_m, into_m, stride=1, share=0.0)

    def worthy(self, goals: Iterable[Goal | None], grid: OccupancyGrid, wave: Wavefront) -> list[Goal]:
        """The goals, where there are any, that are worth the way."""
        return [goal for goal in goals if goal is not None and self.is_worth_the_way(goal, grid, wave)]

    def is_worth_the_way(self, goal: Goal, grid: OccupancyGrid, wave: Wavefront) -> bool:
        """Whether a goal is near, or promises to show something: a small leftover far away does not.

        Nor does what was looked into before. But where the body could go on, a look that was had near by may
        have been at another frontier, or this one has moved on since: one more look tells. Far looks that
        show nothing make the others wait for more of a promise.

        What is near, but dear to get to in tight passages, must promise something as well; looks do not tell
        there, for openings lie close together.
        """
        c = self._chooser.config
        if goal.cost_m <= c.worth_way_m:
            return True
        is_near = self._is_short(goal, grid, wave)
        looks = 0 if is_near else self._looked_at.times(goal.frontier, grid, is_nook=goal.is_nook)
        if goal.is_nook:
            least_m2 = c.least_far_nook_m2(grid.frame.resolution_m)
            return not looks and goal.gain_m2 >= self._demanded(least_m2)
        size_m = goal.frontier.size * grid.frame.resolution_m
        if looks > 1 or (looks and size_m < SPECK_M):
            return False
        least_m2 = c.worth_gain_m2 if is_near else self._demanded(c.worth_gain_m2)
        in_sight_m2 = self._chooser.in_sight_m2(grid, *grid.frame.cell_at(*goal.viewpoint_in_map))
        return in_sight_m2 >= (least_m2 if size_m < LONG_M else min(least_m2, ROOM_M2))

    def _is_short(self, goal: Goal, grid: OccupancyGrid, wave: Wavefront) -> bool:
        """Whether the way to a goal is no longer than what is worth it for anything, in metres driven."""
        most_m = self._chooser.config.worth_way_m
        if math.dist(goal.viewpoint_in_map, wave.start_in_map) > most_m:
            return False
        return wave.length_to_m(grid.frame.cell_at(*goal.viewpoint_in_map)) <= most_m

    def _demanded(self, least_m2: float) -> float:
        """Area demanded: twice as much after each further far look in vain, as the next will be, too."""
        return least_m2 * 2.0 ** max(0, self._looked_at.in_vain - BAD_LUCK)
