"""The navigator: takes the robot to the goal of the moment, and knows when to leave it."""

from __future__ import annotations

from occmap.follower import Follower
from occmap.geometry import Pose2, Twist2
from occmap.goal_search import GoalSearch
from occmap.goals import SAME_GOAL_M, Goal
from occmap.living_map import LivingMap
from occmap.planner import Planner, Wavefront
from occmap.pursuit import Failure, Pursuit, PursuitConfig
from occmap.scan import Observation
from occmap.setbacks import Setbacks


class Navigator:
    """Remembers which goal is pursued, if any, and on which path.

    A goal is left when its frontier is gone, when it was looked into, when it leads nowhere (Setbacks), or
    for a better one. What happens on the way is added to `events`, a sentence each, for the decision log.
    """

    def __init__(
        self,
        config: PursuitConfig,
        planner: Planner,
        follower: Follower,
        living_map: LivingMap,
        search: GoalSearch,
        events: list[str],
    ) -> None:
        self.config = config
        self.pursuit: Pursuit | None = None
        self.replans = 0
        """Paths planned so far."""
        self.goal_switches = 0
        """Goals left for others so far while their frontier was still there."""
        self._planner = planner
        self._follower = follower
        self._map = living_map
        self._search = search
        self._setbacks = Setbacks(config, planner, search.looks, search.looked_at)
        self._events = events

    @property
    def goal(self) -> Goal | None:
        """The goal that is pursued."""
        return self.pursuit.goal if self.pursuit is not None else None

    @property
    def is_blocked(self) -> bool:
        """Whether the map has voided what is left of the path."""
        pursuit, living = self.pursuit, self._map
        return pursuit is not None and self._planner.is_blocked(
            pursuit.path, living.grid, living.clearance_m, pursuit.progress_m
        )

    @property
    def way_left_m(self) -> float:
        """Metres left of the path to the goal pursued; 0 if there is none that still leads there."""
        pursuit = self.pursuit
        holds = pursuit is not None and pursuit.leads_to(pursuit.goal) and not self.is_blocked
        return pursuit.way_left_m if pursuit is not None and holds else 0.0

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._planner.barred.carry_over(new_map_from_old_map)
        self._setbacks.carry_over(new_map_from_old_map, self._map.known_m2)
        if self.pursuit is not None:
            self.pursuit.carry_over(new_map_from_old_map)

    def set_out(self, goal: Goal, wave: Wavefront, now_s: float) -> None:
        """Pursue a goal; on the path already being driven if it still leads there."""
        pursuit = self.pursuit
        if pursuit is not None and pursuit.leads_to(goal) and not self.is_blocked:
            pursuit.goal = goal
        else:
            pursuit = self._plan(goal, wave, now_s)
        self._setbacks.learning.note(self._map.known_m2, pursuit.path.length_m, now_s)

    def drive(self, here: Pose2, twist: Twist2, seen: Observation) -> Twist2:
        """The twist that follows the path, or looks around at its end.

        A goal that leads nowhere is given up. Only while one is pursued. twist: the robot's own, as measured.
        """
        pursuit, living = self.pursuit, self._map
        assert pursuit is not None, "nowhere to drive to"
        steering = self._follower.follow(
            pursuit.path, here, twist, seen.scan, seen.robot_from_lidar, living.grid, living.clearance_m
        )
        commanded = pursuit.advance(steering, seen.time_s)
        self._note(self._setbacks.judge(pursuit, here, living, seen.time_s))
        if pursuit.is_over:
            self.pursuit = None
        return commanded

    def drop_what_is_gone(self) -> None:
        """Count a goal whose frontier is no more as looked at, near or far."""
        goal, living = self.goal, self._map
        if goal is not None and self._search.chooser.is_gone(goal, living.grid, living.frontier_mask):
            self._search.looked_at.note(goal, living.grid)
            self.pursuit = None

    def give_up(self, failure: Failure, now_s: float) -> None:
        """Give up the goal of the moment, if there is one, as pursued in vain."""
        if self.pursuit is not None:
            self._note(self._setbacks.give_up(self.pursuit, failure, self._map.grid, now_s))
        self.pursuit = None

    def break_off(self) -> None:
        """Pursue nothing any more; the goal may be set out for again."""
        self.pursuit = None

    def begin_again(self, now_s: float) -> None:
        """Pursue nothing, and count the time without learning anything from now on."""
        self.break_off()
        self._setbacks.learning.begin(now_s)

    def _plan(self, goal: Goal, wave: Wavefront, now_s: float) -> Pursuit:
        """Plan a path, and begin another pursuit if the goal is another one."""
        grid, left = self._map.grid, self.pursuit
        path = wave.path_to(grid.frame.cell_at(*goal.viewpoint_in_map))
        assert path is not None, "a viewpoint is a cell that the flood has reached"
        if left is None or left.goal.distance_m(goal) > SAME_GOAL_M:
            if left is not None:
                self.goal_switches += 1
                self._note(self._setbacks.turn_back(left, grid, now_s))
            self._note(str(goal))
            self._search.set_out(goal, grid)
        self.replans += 1
        is_tight = path.keep_clear_m < self._planner.body.radius_m
        self.pursuit = Pursuit(self.config, goal, path, grid, now_s, is_tight)
        return self.pursuit

    def _note(self, event: str | None) -> None:
        if event is not None:
            self._events.append(event)
