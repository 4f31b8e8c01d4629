"""The explorer: from one observation to the next twist, until nothing it can reach is unknown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from occmap.certificate import certify
from occmap.clearance import ClearanceConfig
from occmap.decision import Decision, Status, UnknownLeft
from occmap.follower import Follower, FollowerConfig
from occmap.frontiers import FrontierConfig
from occmap.geometry import Pose2, Twist2
from occmap.goal_search import GoalSearch, Search
from occmap.goals import SAME_GOAL_M, Goal, GoalChooser, GoalConfig
from occmap.grid import GridConfig, OccupancyGrid
from occmap.living_map import LivingMap
from occmap.localization.localizer import Estimate, Localizer, OdometryLocalizer
from occmap.memory import FailedLooks, ReachMemory
from occmap.mobility import Mobility
from occmap.planner import Planner, PlannerConfig, Wavefront
from occmap.pursuit import Failure, Pursuit, PursuitConfig
from occmap.recovery import RecoveryConfig
from occmap.scan import Observation
from occmap.sensor_model import SensorModelConfig
from occmap.stopwatch import Stopwatch
from occmap.stuck import StuckConfig

BLIND_SHARE = 0.9
"""With more of its beams failed, a scan says too little to act on."""


@dataclass(frozen=True)
class PaceConfig:
    """When the explorer thinks again."""

    first_look_s: float = 0.5
    """It stands still this long at first: a cell takes a few scans to be believed free."""
    reconsider_s: float = 2.0
    """While a goal is good, its rivals are weighed this often."""
    survey_s: float = 10.0
    """This often it looks farther around for what is reachable than its next goal requires."""
    confirm_s: float = 1.0
    """No goal must turn up for this long before it calls itself done."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must not be negative, got {value}")


@dataclass(frozen=True)
class ExplorerConfig:
    """The robot's mind, part by part."""

    grid: GridConfig = field(default_factory=GridConfig)
    sensor_model: SensorModelConfig = field(default_factory=SensorModelConfig)
    clearance: ClearanceConfig = field(default_factory=ClearanceConfig)
    frontiers: FrontierConfig = field(default_factory=FrontierConfig)
    goals: GoalConfig = field(default_factory=GoalConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    pursuit: PursuitConfig = field(default_factory=PursuitConfig)
    stuck: StuckConfig = field(default_factory=StuckConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    pace: PaceConfig = field(default_factory=PaceConfig)


class Explorer:
    """See, think, act: one `decide` a scan. Knows only what it is handed.

    The map frame is the robot's pose at its first scan.
    """

    def __init__(self, config: ExplorerConfig | None = None, localizer: Localizer | None = None) -> None:
        self.config = config = config or ExplorerConfig()
        self.localizer = localizer or OdometryLocalizer()
        self.map = LivingMap(config.grid, config.sensor_model, config.clearance, config.frontiers)
        self.planner = Planner(config.planner)
        self.follower = Follower(config.follower)
        self.looks = FailedLooks()
        self.search = GoalSearch(GoalChooser(config.goals), self.looks)
        self.reach = ReachMemory()
        self.mobility = Mobility(config.stuck, config.recovery)
        self.status = Status.EXPLORING
        self.pursuit: Pursuit | None = None
        self._unknown_left: tuple[UnknownLeft, ...] = ()
        self._events: list[str] = []
        self._watch = Stopwatch()
        self._replans = 0
        self._goal_switches = 0
        self._begun_s: float | None = None
        self._considered_s = -math.inf
        self._surveyed_s = -math.inf
        self._goalless_since_s: float | None = None
        self._last_seen: Observation | None = None

    @property
    def grid(self) -> OccupancyGrid:
        """The belief, alive."""
        return self.map.grid

    def decide(self, seen: Observation) -> Decision:
        """What to do until the next scan, given this one."""
        self._events, self._watch = [], Stopwatch()
        here, seen = self._see(seen)
        with self._watch.lap("planning"):
            activity, twist = self._act(seen, here)
        self.mobility.remember(seen, twist)
        self._last_seen = seen
        return self._decision(here, activity, twist)

    def _see(self, seen: Observation) -> tuple[Pose2, Observation]:
        """Localise, and spend the scan on the map: the pose, and the scan as seen from that one pose."""
        with self._watch.lap("localization"):
            estimate = self.localizer.update(seen)
        if estimate.grid is not None:
            self._take_over(estimate.grid, estimate)
        if estimate.scan is not None:
            seen = replace(seen, scan=estimate.scan)
        if estimate.insert:
            map_from_lidar = estimate.map_from_robot @ seen.robot_from_lidar
            self.map.insert(seen.scan, map_from_lidar, self._watch)
        return estimate.map_from_robot, seen

    def _take_over(self, grid: OccupancyGrid, estimate: Estimate) -> None:
        """The localizer has corrected the past: take its map, and carry over what is remembered."""
        self.map.replace(grid)
        self.reach = ReachMemory()
        if estimate.map_shift is not None:
            self.looks.carry_over(estimate.map_shift)
        self.pursuit = None
        self._events.append("the map was corrected")

    def _act(self, seen: Observation, here: Pose2) -> tuple[str, Twist2]:
        """The activity of the moment and its twist."""
        if self._is_looking_around(seen.time_s):
            return "looking", Twist2.zero()
        if self.status is Status.EXPLORING and np.isnan(seen.scan.ranges_m).mean() > BLIND_SHARE:
            return "blind", Twist2.zero()
        manoeuvre = self._recover(seen, here) if self.status is Status.EXPLORING else None
        if manoeuvre is not None:
            return "recovering", manoeuvre
        if self.status is Status.EXPLORING and self._should_think(seen.time_s):
            self._think(seen, here)
        if self.status is not Status.EXPLORING:
            return self.status.value, Twist2.zero()
        if self.pursuit is None:
            return "looking", Twist2.zero()
        return self._pursue(self.pursuit, seen, here)

    def _is_looking_around(self, now_s: float) -> bool:
        """The first moments."""
        if self._begun_s is None:
            self._begun_s = now_s
        return now_s - self._begun_s < self.config.pace.first_look_s

    def _recover(self, seen: Observation, here: Pose2) -> Twist2 | None:
        """The twist of a manoeuvre that frees the robot, if it is stuck; the end if none does."""
        attempts = self.mobility.recovery.attempts
        manoeuvre = self.mobility.manoeuvre(seen)
        if self.mobility.is_hopeless:
            self._events.append(f"stuck: {attempts} manoeuvres did not free it")
            self._end(Status.STUCK, self._flood(here))
        elif self.mobility.recovery.attempts > attempts:
            self._events.append(f"the robot does not move: manoeuvre {attempts + 1}")
            self.pursuit = None
        return manoeuvre

    def _should_think(self, now_s: float) -> bool:
        """At once if there is no goal, or no good one; a good one is weighed against others now and then."""
        pursuit = self.pursuit
        if pursuit is None:
            return True
        if self.search.chooser.is_gone(pursuit.goal, self.grid, self.map.frontier_mask):
            self.pursuit = None
            return True
        if self._is_blocked(pursuit):
            return True
        is_due = pursuit.has_strayed or now_s - self._considered_s >= self.config.pace.reconsider_s
        return is_due and not pursuit.has_arrived

    def _think(self, seen: Observation, here: Pose2) -> None:
        """Choose a goal and a path to it; if there is none to be had for a while, end."""
        self._considered_s = seen.time_s
        with self._watch.lap("frontiers"):
            frontiers = self.map.find_frontiers()
        found = self.search.run(
            frontiers,
            self.grid,
            lambda bound_m: self._flood(here, bound_m),
            seen.scan.max_range_m,
            widely=self._is_survey_due(seen.time_s),
        )
        self.reach.note(found.wave, self.grid)
        goal = self._prefer(found)
        if goal is not None:
            self._goalless_since_s = None
            self._set_out(goal, found.wave, seen.time_s)
        else:
            self._consider_ending(found.wave, seen.time_s)

    def _is_survey_due(self, now_s: float) -> bool:
        """Now and then a flood goes farther than a goal needs it: what is reachable is worth remembering."""
        if now_s - self._surveyed_s < self.config.pace.survey_s:
            return False
        self._surveyed_s = now_s
        return True

    def _prefer(self, found: Search) -> Goal | None:
        """The best goal, or the one pursued where the best is not much better."""
        if found.best is None or self.pursuit is None:
            return found.best
        same = self.search.chooser.successor(self.pursuit.goal, found.goals)
        if same is not None and found.best.utility < same.utility + self.config.goals.hysteresis_m:
            return same
        self._goal_switches += 1
        return found.best

    def _set_out(self, goal: Goal, wave: Wavefront, now_s: float) -> None:
        """Pursue a goal; on the path already being driven if it still leads there."""
        pursuit = self.pursuit
        if pursuit is not None and pursuit.leads_to(goal) and not self._is_blocked(pursuit):
            pursuit.goal = goal
            return
        path = wave.path_to(self.grid.frame.cell_at(*goal.viewpoint_in_map))
        assert path is not None, "a viewpoint is a cell that the flood has reached"
        if pursuit is None or pursuit.goal.distance_m(goal) > SAME_GOAL_M:
            self._events.append(str(goal))
        self._replans += 1
        is_tight = path.keep_clear_m < self.config.planner.body_radius_m
        self.pursuit = Pursuit(self.config.pursuit, goal, path, now_s, is_tight)

    def _flood(self, here: Pose2, within_m: float = math.inf) -> Wavefront:
        cell = self.grid.frame.cell_at(here.x_m, here.y_m)
        return self.planner.flood(self.grid, self.map.clearance_m, cell, within_m=within_m)

    def _is_blocked(self, pursuit: Pursuit) -> bool:
        return self.planner.is_blocked(pursuit.path, self.grid, self.map.clearance_m, pursuit.progress_m)

    def _consider_ending(self, wave: Wavefront, now_s: float) -> None:
        """No goal: wait a little for one to turn up, then end with the certificate."""
        self.pursuit = None
        if self._goalless_since_s is None:
            self._goalless_since_s = now_s
        elif now_s - self._goalless_since_s >= self.config.pace.confirm_s:
            roomy = self.planner.traversable(self.grid, self.map.clearance_m)
            is_sealed = self.reach.is_cut_off(wave, self.grid, roomy)
            self._end(Status.SEALED_IN if is_sealed else Status.COMPLETE, wave)

    def _end(self, status: Status, wave: Wavefront) -> None:
        self.status = status
        self.pursuit = None
        body_radius_m = self.config.planner.body_radius_m
        self._unknown_left = certify(
            self.map.frontiers, self.grid, wave, self.looks, self.config.goals, body_radius_m
        )
        self._events.append(f"{status.value}: {len(self._unknown_left)} frontiers left unseen")

    def _pursue(self, pursuit: Pursuit, seen: Observation, here: Pose2) -> tuple[str, Twist2]:
        """Drive on, or look if there; give the goal up if that leads nowhere."""
        steering = self.follower.follow(
            pursuit.path, here, self._twist_of(seen), seen.scan, seen.robot_from_lidar,
            self.grid, self.map.clearance_m,
        )  # fmt: skip
        twist = pursuit.advance(steering, seen.time_s)
        failure = pursuit.failure(here, seen.time_s)
        if failure is not None:
            self._give_up(pursuit.goal, failure)
        return "looking" if pursuit.has_arrived else "exploring", twist

    def _give_up(self, goal: Goal, failure: Failure) -> None:
        self.looks.note(goal.frontier, failure.reason, failure.why, self.grid)
        self._events.append(f"gave up {goal}: {failure.why}")
        self.pursuit = None

    def _twist_of(self, seen: Observation) -> Twist2:
        """The robot's own motion, as its odometry has it since the last scan."""
        last = self._last_seen
        if last is None or seen.time_s <= last.time_s:
            return Twist2.zero()
        moved = last.odom_from_robot.inverse() @ seen.odom_from_robot
        dt_s = seen.time_s - last.time_s
        return Twist2(moved.x_m / dt_s, moved.yaw_rad / dt_s)

    def _decision(self, here: Pose2, activity: str, twist: Twist2) -> Decision:
        pursuit = self.pursuit
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
            replans=self._replans,
            goal_switches=self._goal_switches,
            stage_s=self._watch.totals_s(),
        )
