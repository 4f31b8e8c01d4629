"""The explorer: from one observation to the next twist, until nothing it can reach is unknown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from occmap.body import Body
from occmap.boundary import Boundary
from occmap.certificate import certificate
from occmap.decision import Decision, Reason, Status, UnknownLeft
from occmap.ending import Ending
from occmap.explorer_config import ExplorerConfig
from occmap.follower import Follower
from occmap.frontiers import Frontier
from occmap.geometry import Pose2, Twist2
from occmap.goal_search import GoalSearch
from occmap.goals import GoalChooser
from occmap.grid import OccupancyGrid
from occmap.living_map import LivingMap
from occmap.localization.localizer import Localizer, OdometryLocalizer
from occmap.memory import FailedLooks
from occmap.mobility import Mobility
from occmap.navigator import Navigator
from occmap.pace import Pace
from occmap.perception import Perception
from occmap.planner import Planner, Wavefront, WideningFlood
from occmap.pursuit import Failure
from occmap.scan import Observation, Scan
from occmap.silent_odometry import SilentOdometry
from occmap.slices import Sliced, finish, take_turn
from occmap.steady_clock import SteadyClock
from occmap.stopwatch import Stopwatch

__all__ = ["Explorer", "ExplorerConfig"]

BLIND_SHARE = 0.9
"""With more of its beams failed, a scan says too little to act on."""


def _is_blind(scan: Scan) -> bool:
    """Whether hardly any beam says something: they failed, or something covers the lidar."""
    says_something = np.count_nonzero(scan.ranges_m >= scan.least_range_m)
    return bool(says_something <= (1.0 - BLIND_SHARE) * len(scan.ranges_m))


class Explorer:
    """See, think, act: one `decide` a scan. Knows only what it is handed.

    The map frame is the robot's pose at its first scan. Where it is the localizer says: SlamLocalizer, or by
    default the odometry as it is. Exploration is frontier-based (Yamauchi, A frontier-based approach for
    autonomous exploration, CIRA 1997): look into an edge of the unknown, until no edge is left that could be
    looked into.

    It ends in every finite world that comes to rest and that its lidar sees. While it has a goal,
    within a bounded time either LEARNT_M2 more is known, which a finite world allows finitely often, or
    the goal is given up (Setbacks). A place is given up after at most len(look_from_m) looks, and
    these are forgotten only where the map around it changes (FailedLooks). When no goal is left it
    stops after confirm_s. Manoeuvres to free it are counted (Mobility).

    A robot that is lost in a finished map (MapLocalizer) stands, neither maps nor ends, and goes on once it
    is found. Where standing does not tell, because places look alike, drive it by hand and keep asking.

    What takes long on a large map is thought in turns, standing, about the map as it was at the first of
    them: scans of the meantime are spent on it afterwards.
    """

    def __init__(
        self,
        config: ExplorerConfig | None = None,
        localizer: Localizer | None = None,
        body: Body | None = None,
    ) -> None:
        self.config = config = config or ExplorerConfig()
        self.body = body = body or Body()
        boundary = Boundary(config.boundary_in_map) if config.boundary_in_map else None
        clearance = config.clearance.reaching(body.radius_m + config.planner.roomy_margin_m)
        self.map = LivingMap(config.grid, config.sensor_model, clearance, config.frontiers, boundary)
        self.perception = Perception(localizer or OdometryLocalizer(), self.map)
        self.planner = Planner(config.planner, body, boundary)
        self.follower = Follower(config.follower, body)
        self.search = GoalSearch(GoalChooser(config.goals), FailedLooks(), boundary)
        self._events: list[str] = []  # of the decision of the moment
        self.navigator = Navigator(
            config.pursuit, self.planner, self.follower, self.map, self.search, self._events
        )
        self.mobility = Mobility(config.stuck, config.recovery, body)
        self.pace = Pace(config.pace)
        self.ending = Ending(config.ending)
        self._clock = SteadyClock(body.period_s)
        self._silent_odometry = SilentOdometry()
        self.status = Status.EXPLORING
        self._unknown_left: tuple[UnknownLeft, ...] = ()
        self._watch = Stopwatch()
        self._last: tuple[Pose2, Observation] | None = None
        self._is_lost = False
        self._thought: Sliced[None] | None = None

    @property
    def grid(self) -> OccupancyGrid:
        """The belief, alive."""
        return self.map.grid

    def decide(self, seen: Observation) -> Decision:
        """What to do until the next scan, given this one."""
        self._events.clear()
        self._watch = Stopwatch()
        seen = replace(seen, time_s=self._clock.read(seen.time_s))
        self.pace.begin(seen.time_s)
        self._last = here, seen = self._see(seen)
        activity, twist = self._act(here, seen)
        self.mobility.remember(seen, twist)
        return self._decision(here, activity, twist)

    def _see(self, seen: Observation) -> tuple[Pose2, Observation]:
        """Take an observation in: the pose, and what was seen as seen from that one pose."""
        is_held, is_over = self._thought is not None, self.status is not Status.EXPLORING
        self.search.chooser.sight_m = min(seen.scan.max_range_m, self.config.sensor_model.usable_range_m)
        percept = self.perception.take_in(seen, self._watch, is_held=is_held, is_over=is_over)
        if percept.new_map_from_old_map is not None:
            self._carry_over(percept.new_map_from_old_map)
        self._note_whether_lost(percept.is_lost, seen.time_s)
        here = percept.map_from_robot
        return here, self._silent_odometry.made_up_for(percept.seen, here)

    def _carry_over(self, new_map_from_old_map: Pose2) -> None:
        """The localizer has corrected the past: go on in its map with what is remembered."""
        self._thought = None
        self.pace.forget_the_map()
        self._silent_odometry.carry_over(new_map_from_old_map)
        self.ending.carry_over(new_map_from_old_map, self.grid)
        self.search.carry_over(new_map_from_old_map)
        self.navigator.carry_over(new_map_from_old_map)
        if self.status is not Status.EXPLORING:
            self.map.restore_surfaces()
        self._events.append("the map was corrected")

    def _note_whether_lost(self, is_lost: bool, now_s: float) -> None:
        """Lost, drop what was thought and meant to be done: it was about another place."""
        if is_lost and self.status is Status.EXPLORING:
            self._thought = None
            self.navigator.begin_again(now_s)
            self.ending.begin_again()
        if is_lost != self._is_lost:
            self._events.append("the robot is lost" if is_lost else "the robot is found")
        self._is_lost = is_lost

    def _act(self, here: Pose2, seen: Observation) -> tuple[str, Twist2]:
        """The activity of the moment and its twist."""
        if self._is_lost and self.status is Status.EXPLORING:
            return "lost", Twist2.zero()
        if self.pace.is_first_look(seen.time_s):
            return "looking", Twist2.zero()
        if self.status is Status.EXPLORING and _is_blind(seen.scan):
            return "blind", Twist2.zero()
        manoeuvre = self._recover(here, seen) if self.status is Status.EXPLORING else None
        if manoeuvre is not None:
            self._thought = None
            return "recovering", manoeuvre
        if self.status is Status.EXPLORING and not self.map.is_settling:
            self._think(here, seen)
            if self._thought is None and self.ending.is_survey_due(seen.time_s):
                with self._watch.lap("planning"):
                    wave = self._flood(here, self.config.ending.survey_m)
                    self.ending.survey(wave, self.grid, seen.time_s)
        if self._thought is not None:
            return "thinking", Twist2.zero()
        if self.status is not Status.EXPLORING:
            return self.status.value, Twist2.zero()
        pursuit = self.navigator.pursuit
        if pursuit is None:
            return "looking", Twist2.zero()
        if pursuit.is_void and self.map.is_settling:  # its path is of the map before the correction
            return "thinking", Twist2.zero()
        with self._watch.lap("planning"):
            twist = self.navigator.drive(here, self.mobility.measured_twist(seen), seen)
        return "looking" if pursuit.has_arrived else "exploring", twist

    def _recover(self, here: Pose2, seen: Observation) -> Twist2 | None:
        """The twist of a manoeuvre that frees the robot, if it is stuck; the end if none does."""
        attempts = self.mobility.attempts
        manoeuvre = self.mobility.manoeuvre(
            seen, lambda ahead_m: self.map.clearance_at(here @ Pose2(ahead_m, 0.0, 0.0))
        )
        if self.mobility.is_hopeless:
            self._events.append(f"stuck: {attempts} manoeuvres did not free it")
            finish(self._end(Status.STUCK, self._flood(here)))
        elif self.mobility.attempts > attempts:
            self._events.append(f"the robot does not move: manoeuvre {attempts + 1}")
            if attempts == 0:  # a series counts as one try
                failure = Failure(Reason.UNSAFE, "the robot got stuck on the way")
                self.navigator.give_up(failure, seen.time_s)
            self.navigator.break_off()
        return manoeuvre

    def _should_think(self, now_s: float) -> bool:
        """At once if there is no goal, or no good one; a good one is weighed against others now and then."""
        pursuit = self.navigator.pursuit
        if pursuit is None:
            return self.ending.is_search_due(now_s)
        if pursuit.has_arrived or pursuit.is_void:
            return pursuit.is_void
        is_due = self.pace.is_due(self.map.known_m2, now_s, is_nook=pursuit.goal.is_nook)
        return is_due or self.navigator.is_blocked

    def _think(self, here: Pose2, seen: Observation) -> None:
        """Take a turn at thinking, if there is something to think about."""
        if self._thought is None:
            self.navigator.drop_what_is_gone()
            if not self._should_think(seen.time_s):
                return
            self.pace.weigh(self.map.known_m2, seen.time_s)
            with self._watch.lap("frontiers"):
                frontiers = self.map.find_frontiers()
            self._thought = self._choose(frontiers, here, seen)
        with self._watch.lap("planning"):
            if take_turn(self._thought):
                self._thought = None

    def _choose(self, frontiers: list[Frontier], here: Pose2, seen: Observation) -> Sliced[None]:
        """A goal and a path to it; if there is none to be had for a while, end."""
        flood = WideningFlood(self.planner, self.grid, self.map.clearance_m, here)
        found = yield from self.search.run(
            frontiers, self.grid, flood, self.navigator.goal, self.navigator.way_left_m
        )
        self.ending.note(found.best is not None, found.wave, self.grid, seen.time_s)
        if found.best is None:
            self.navigator.break_off()
            if not self.planner.barred.reopen():
                yield from self._end_if_done(found.wave, seen)
        else:
            self.navigator.set_out(found.best, found.wave, seen.time_s)

    def _flood(self, here: Pose2, within_m: float = math.inf) -> Wavefront:
        cell = self.grid.frame.cell_at(here.x_m, here.y_m)
        return self.planner.flood(self.grid, self.map.clearance_m, cell, within_m=within_m)

    def _end_if_done(self, wave: Wavefront, seen: Observation) -> Sliced[None]:
        yield wave.n_reached // 2
        roomy = self.planner.traversable(self.grid, self.map.clearance_m)
        status = self.ending.status(wave, self.grid, roomy, seen.time_s)
        if status is not Status.EXPLORING:
            yield from self._end(status, wave)

    def _end(self, status: Status, wave: Wavefront) -> Sliced[None]:
        self.navigator.break_off()
        unknown_left = yield from self._certified(status, wave)
        yield self.grid.state.size
        self.status, self._unknown_left = status, unknown_left
        self.map.restore_surfaces()
        self._events.append(f"{status.value}: {len(self._unknown_left)} frontiers left unseen")

    def certificate(self) -> tuple[UnknownLeft, ...]:
        """Each frontier that remains, and why; can be asked for at any time, also before the end."""
        if self.status is not Status.EXPLORING or self._last is None:
            return self._unknown_left
        here, _ = self._last
        self._thought = None  # its flood is void
        return finish(self._certified(self.status, self._flood(here)))

    def _certified(self, status: Status, wave: Wavefront) -> Sliced[tuple[UnknownLeft, ...]]:
        is_early = status in (Status.EXPLORING, Status.STUCK)
        return certificate(self.search, self.map, wave, self.body, is_early=is_early)

    def _decision(self, here: Pose2, activity: str, twist: Twist2) -> Decision:
        pursuit = self.navigator.pursuit
        return Decision(
            status=self.status,
            twist=twist,
            map_from_robot=here,
            activity=activity,
            goal=pursuit.goal if pursuit else None,
            path=pursuit.path if pursuit else None,
            frontiers=tuple(self.map.frontiers),
            unknown_left=self._unknown_left,
            events=tuple(self._events),
            replans=self.navigator.replans,
            goal_switches=self.navigator.goal_switches,
            stage_s=self._watch.totals_s(),
        )
