"""What becomes of a goal that leads nowhere: given up, or reached another way."""

from __future__ import annotations

from occmap.barred import TRIES, TRIES_WHERE_PASSED
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.living_map import LivingMap
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.planner import Planner
from occmap.pursuit import Failure, Learning, Pursuit, PursuitConfig
from occmap.trail import Trail


class Setbacks:
    """Judges pursuits. Its verdicts are remembered by the looks that failed and by the planner's gaps.

    Each method changes the pursuit, and returns what happened, as a sentence for the decision log, if
    anything did.
    """

    def __init__(
        self, config: PursuitConfig, planner: Planner, looks: FailedLooks, looked_at: LookedAt
    ) -> None:
        self.learning = Learning(config, planner.body)
        self.trail = Trail()
        self._planner = planner
        self._looks = looks
        self._looked_at = looked_at

    def carry_over(self, new_map_from_old_map: Pose2, known_m2: float) -> None:
        """Follow a correction of the map, of which so much is known now."""
        self.learning.carry_over(new_map_from_old_map, known_m2)
        self.trail.carry_over(new_map_from_old_map)

    def judge(self, pursuit: Pursuit, here: Pose2, living: LivingMap, now_s: float) -> str | None:
        """Give a goal up that leads nowhere; one that was looked into, if only in part, has done its duty."""
        self.trail.note(here)
        fruitless = self.learning.failure(now_s)
        failure = fruitless or pursuit.failure(here, now_s)
        if failure is None:
            return None
        if pursuit.has_arrived:
            self._looked_at.note(pursuit.goal, living.grid)
        if fruitless is None and pursuit.has_arrived and pursuit.has_shown_something(living.grid):
            pursuit.is_over = True
            return None
        event = self._blame_gap(pursuit, living) if fruitless is None else None
        return event or self.give_up(pursuit, failure, living.grid, now_s)

    def turn_back(self, pursuit: Pursuit, grid: OccupancyGrid, now_s: float) -> str | None:
        """Leave a goal for another; for good if that has happened too often."""
        failure = self.learning.turned_back(pursuit)
        return None if failure is None else self.give_up(pursuit, failure, grid, now_s)

    def give_up(self, pursuit: Pursuit, failure: Failure, grid: OccupancyGrid, now_s: float) -> str:
        """Remember that a goal was pursued in vain, and why."""
        self._looks.note(pursuit.goal, failure.reason, failure.why, grid)
        self.learning.begin(now_s)
        pursuit.is_over = True
        return f"gave up {pursuit.goal}: {failure.why}"

    def _blame_gap(self, pursuit: Pursuit, living: LivingMap) -> str | None:
        """Whether a narrow place held the robot up: there may be another way to the goal.

        One that the robot has come through is tried for longer: closed, it would shut the robot in.
        """
        if pursuit.has_arrived or not pursuit.is_tight:
            return None
        gap = self._planner.gap_ahead(pursuit.path, living.grid, living.clearance_m, pursuit.progress_m)
        came_through = gap is not None and self.trail.leads_through(gap)
        if not came_through and self.learning.is_barred(pursuit):
            return None
        if gap is None or not self._planner.barred.note(gap, TRIES_WHERE_PASSED if came_through else TRIES):
            return None
        if not came_through:
            self._looked_at.note(pursuit.goal, living.grid)  # it is not worth as long a way again
        pursuit.is_void = True
        return "the gap at ({:.1f}, {:.1f}) holds the robot up".format(*gap.in_map)
