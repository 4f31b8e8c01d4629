"""The explorer: from one observation to the next twist, until nothing it can reach is unknown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from occmap.certificate import certify
from occmap.clearance import ClearanceConfig, ClearanceMap
from occmap.decision import Decision, Reason, Status, UnknownLeft
from occmap.follower import Follower, FollowerConfig
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.geometry import Pose2, Twist2
from occmap.goal_search import GoalSearch, Search
from occmap.goals import SAME_GOAL_M, Goal, GoalChooser, GoalConfig
from occmap.grid import CellBox, GridConfig, OccupancyGrid
from occmap.localization.localizer import Estimate, Localizer, OdometryLocalizer
from occmap.mapper import GridChange, Mapper
from occmap.memory import FailedLooks, ReachMemory
from occmap.planner import Path, Planner, PlannerConfig, Wavefront
from occmap.recovery import Recovery, RecoveryConfig
from occmap.scan import Observation
from occmap.sensor_model import SensorModelConfig
from occmap.stopwatch import Stopwatch
from occmap.stuck import StuckConfig, StuckDetector


SAME_VIEWPOINT_M = 0.3
"""A path that ends this near to a viewpoint leads to it."""
STRAYED_M = 0.4
"""Farther beside its path the robot plans anew."""


@dataclass(frozen=True)
class PaceConfig:
    """When the explorer thinks again."""

    first_look_s: float = 0.5
    """It stands still this long at first: a cell takes a few scans to be believed free."""
    reconsider_s: float = 2.0
    """While a goal is good, its rivals are weighed this often."""
    look_s: float = 0.6
    """At a viewpoint it waits this long for its frontier to be resolved."""
    look_turn_radps: float = 0.1
    """Meanwhile it turns a little, so that its beams sweep over what lay between them."""
    confirm_s: float = 1.0
    """No goal must turn up for this long before it calls itself done."""
    held_up_s: float = 4.0
    """Something in the scan that bars the way for this long makes a goal unsafe."""
    patience_s: float = 10.0
    """A goal that comes no nearer for this long is given up."""
    sealed_m2: float = 0.5
    """Losing more than this of what was once reachable means being sealed in."""

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
    stuck: StuckConfig = field(default_factory=StuckConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    pace: PaceConfig = field(default_factory=PaceConfig)


@dataclass
class Pursuit:
    """A goal being driven to."""

    goal: Goal
    path: Path
    arrived_s: float | None = None
    progress_m: float = 0.0
    """How far along the path the robot is."""
    best_to_go_m: float = math.inf
    progress_s: float = 0.0
    """When the way to go last shrank by a little."""

    def note_progress(self, progress_m: float, now_s: float) -> None:
        self.progress_m = progress_m
        to_go_m = self.path.length_m - progress_m
        if to_go_m < self.best_to_go_m - 0.05:
            self.best_to_go_m, self.progress_s = to_go_m, now_s


class Explorer:
    """See, think, act: one `decide` a scan. Knows only what it is handed.

    The map frame is the robot's pose at its first scan. `grid` is the belief, alive.
    """

    def __init__(self, config: ExplorerConfig | None = None, localizer: Localizer | None = None) -> None:
        self.config = config = config or ExplorerConfig()
        self.localizer = localizer or OdometryLocalizer()
        self.grid = OccupancyGrid(config.grid)
        self.mapper = Mapper(config.sensor_model)
        self.clearance = ClearanceMap(config.clearance)
        self.frontiers = FrontierMap(config.frontiers)
        self.planner = Planner(config.planner)
        self.follower = Follower(config.follower)
        self.looks = FailedLooks()
        self.search = GoalSearch(GoalChooser(config.goals), self.looks)
        self.reach = ReachMemory()
        self.stuck = StuckDetector(config.stuck)
        self.recovery = Recovery(config.recovery)
        self.status = Status.EXPLORING
        self.pursuit: Pursuit | None = None
        self._clusters: list[Frontier] = []
        self._unknown_left: tuple[UnknownLeft, ...] = ()
        self._events: list[str] = []
        self._replans = 0
        self._goal_switches = 0
        self._begun_s: float | None = None
        self._considered_s = -math.inf
        self._stuck_asked_s = -math.inf
        self._goalless_since_s: float | None = None
        self._last_seen: Observation | None = None

    def decide(self, seen: Observation) -> Decision:
        """What to do until the next scan, given this one."""
        self._events = []
        self._watch = Stopwatch()
        here = self._absorb(seen)
        with self._watch.lap("planning"):
            activity, twist = self._act(seen, here)
        self.stuck.remember(seen, twist)
        self._last_seen = seen
        pursuit = self.pursuit
        return Decision(
            status=self.status,
            twist=twist,
            map_from_robot=here,
            activity=activity,
            goal=pursuit.goal if pursuit else None,
            path=pursuit.path if pursuit else None,
            frontiers=tuple(self._clusters),
            unknown_left=self._unknown_left,
            events=tuple(self._events),
            replans=self._replans,
            goal_switches=self._goal_switches,
            stage_s=self._watch.totals_s(),
        )

    # -- seeing ----------------------------------------------------------------------------------

    def _absorb(self, seen: Observation) -> Pose2:
        """Localise, and spend the scan on the map and its layers."""
        with self._watch.lap("localization"):
            estimate = self.localizer.update(seen)
        if estimate.grid is not None:
            self._swap_map(estimate)
        if estimate.insert:
            with self._watch.lap("mapping"):
                change = self.mapper.insert(
                    seen.scan, estimate.map_from_robot @ seen.robot_from_lidar, self.grid
                )
                self.clearance.update(self.grid, change)
            with self._watch.lap("frontiers"):
                self.frontiers.update(self.grid, change)
                if change.grew:
                    self._clusters = self.frontiers.clusters(self.grid)
        return estimate.map_from_robot

    def _swap_map(self, estimate: Estimate) -> None:
        """The localizer has corrected the past: take its map, and carry over what is remembered."""
        assert estimate.grid is not None
        self.grid = estimate.grid
        everything = GridChange.of_everything(self.grid)
        self.clearance.update(self.grid, everything)
        self.frontiers.update(self.grid, everything)
        self._clusters = self.frontiers.clusters(self.grid)
        self.reach = ReachMemory()
        if estimate.map_shift is not None:
            self.looks.carry_over(estimate.map_shift)
        self.pursuit = None
        self._events.append("the map was corrected")

    # -- thinking --------------------------------------------------------------------------------

    def _act(self, seen: Observation, here: Pose2) -> tuple[str, Twist2]:
        """The activity of the moment and its twist."""
        now_s, pace = seen.time_s, self.config.pace
        if self._begun_s is None:
            self._begun_s = now_s
        if self.status is not Status.EXPLORING:
            return self.status.value, Twist2.zero()
        if now_s - self._begun_s < pace.first_look_s:
            return "looking", Twist2.zero()
        if np.isnan(seen.scan.ranges_m).mean() > 0.9:
            return "blind", Twist2.zero()
        manoeuvre = self._recover(seen, here)
        if manoeuvre is not None:
            return "recovering", manoeuvre
        if self.status is not Status.EXPLORING:
            return self.status.value, Twist2.zero()
        if self._should_think(now_s):
            self._think(seen, here)
        if self.pursuit is None:
            return self.status.value if self.status is not Status.EXPLORING else "looking", Twist2.zero()
        return self._pursue(self.pursuit, seen, here)

    def _recover(self, seen: Observation, here: Pose2) -> Twist2 | None:
        """The twist of a manoeuvre that frees the robot; None if it is not stuck, or cannot be freed."""
        manoeuvre = self.recovery.twist(seen.time_s)
        if manoeuvre is None and self._is_stuck(seen):
            if self.recovery.is_exhausted:
                self._events.append(f"stuck: {self.recovery.attempts} manoeuvres did not free it")
                self._end(Status.STUCK, self._flood(here))
                return None
            self._events.append(f"the robot does not move: manoeuvre {self.recovery.attempts + 1}")
            self.recovery.begin(seen.time_s, self.stuck.last_twist, seen.scan)
            self.stuck.reset()
            self.pursuit = None
            manoeuvre = self.recovery.twist(seen.time_s)
        return manoeuvre

    def _is_stuck(self, seen: Observation) -> bool:
        """Asked now and then: it takes seconds to tell."""
        if seen.time_s - self._stuck_asked_s < self.config.pace.reconsider_s / 4.0:
            return False
        self._stuck_asked_s = seen.time_s
        return self.stuck.is_stuck(seen)

    def _should_think(self, now_s: float) -> bool:
        """A goal is dropped the moment its frontier is gone; a good one is weighed against others now and then."""
        pursuit = self.pursuit
        if pursuit is None:
            return True
        if self.search.chooser.is_gone(pursuit.goal, self.grid, self.frontiers.mask):
            self.pursuit = None
            return True
        if self.planner.is_blocked(pursuit.path, self.grid, self.clearance.distance_m, pursuit.progress_m):
            return True
        return pursuit.arrived_s is None and now_s - self._considered_s >= self.config.pace.reconsider_s

    def _think(self, seen: Observation, here: Pose2) -> None:
        """Choose a goal and a path to it; if there is none to be had for a while, end."""
        self._considered_s = seen.time_s
        with self._watch.lap("frontiers"):
            self._clusters = self.frontiers.clusters(self.grid)
        found = self.search.run(
            self._clusters, self.grid, lambda bound_m: self._flood(here, bound_m), seen.scan.max_range_m
        )
        self.reach.note(found.wave, self.grid)
        goal = self._prefer(found)
        if goal is not None:
            self._goalless_since_s = None
            self._set_out(goal, found.wave, seen.time_s)
        else:
            self._consider_ending(found.wave, seen.time_s)

    def _flood(self, here: Pose2, within_m: float = math.inf) -> Wavefront:
        cell = self.grid.frame.cell_at(here.x_m, here.y_m)
        return self.planner.flood(self.grid, self.clearance.distance_m, cell, within_m=within_m)

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
        if pursuit is not None and self._still_leads_to(goal, pursuit):
            pursuit.goal = goal
            return
        path = wave.path_to(self.grid.frame.cell_at(*goal.viewpoint_in_map))
        assert path is not None, "a viewpoint is a cell that the flood has reached"
        if pursuit is None or pursuit.goal.distance_m(goal) > SAME_GOAL_M:
            self._events.append(str(goal))
        self._replans += 1
        self.pursuit = Pursuit(goal, path, progress_s=now_s)

    def _still_leads_to(self, goal: Goal, pursuit: Pursuit) -> bool:
        end_x, end_y = pursuit.path.goal
        x, y = goal.viewpoint_in_map
        return math.hypot(x - end_x, y - end_y) < SAME_VIEWPOINT_M and not self.planner.is_blocked(
            pursuit.path, self.grid, self.clearance.distance_m, pursuit.progress_m
        )

    def _consider_ending(self, wave: Wavefront, now_s: float) -> None:
        """No goal: wait a little for one to turn up, then end with the certificate."""
        self.pursuit = None
        if self._goalless_since_s is None:
            self._goalless_since_s = now_s
        elif now_s - self._goalless_since_s >= self.config.pace.confirm_s:
            lost_m2 = self.reach.lost_m2(wave, self.grid, self._comfortable())
            self._end(Status.SEALED_IN if lost_m2 > self.config.pace.sealed_m2 else Status.COMPLETE, wave)

    def _comfortable(self) -> NDArray[np.bool_]:
        return self.planner.traversable(self.grid, self.clearance.distance_m)

    def _end(self, status: Status, wave: Wavefront) -> None:
        self.status = status
        self.pursuit = None
        self._unknown_left = certify(
            self._clusters,
            self.grid,
            wave,
            self.looks,
            self.config.goals.min_frontier_m,
            self.config.goals.look_from_m[-1],
            self.config.planner.body_radius_m,
        )
        self._events.append(f"{status.value}: {len(self._unknown_left)} frontiers left unseen")

    # -- acting ----------------------------------------------------------------------------------

    def _pursue(self, pursuit: Pursuit, seen: Observation, here: Pose2) -> tuple[str, Twist2]:
        """Drive on, or look if there; give the goal up if it is not getting nearer."""
        steering = self.follower.follow(
            pursuit.path,
            here,
            self._twist_of(seen),
            seen.scan,
            seen.robot_from_lidar,
            self.grid,
            self.clearance.distance_m,
        )
        pursuit.note_progress(steering.progress_m, seen.time_s)
        pace = self.config.pace
        if steering.arrived:
            pursuit.arrived_s = seen.time_s if pursuit.arrived_s is None else pursuit.arrived_s
            if seen.time_s - pursuit.arrived_s >= pace.look_s:
                self._give_up(
                    Reason.GAVE_UP, "looked at it from ({:.2f}, {:.2f}) in vain".format(*here.position)
                )
            return "looking", Twist2(0.0, pace.look_turn_radps)
        if steering.held_up_s > pace.held_up_s:
            self._give_up(
                Reason.UNSAFE, "an obstacle bars the way at ({:.2f}, {:.2f})".format(*here.position)
            )
        elif seen.time_s - pursuit.progress_s > pace.patience_s:
            self._give_up(Reason.UNSAFE, "came no nearer than {:.2f} m".format(pursuit.best_to_go_m))
        elif steering.off_path_m > STRAYED_M:
            self._considered_s = -math.inf
        return "exploring", steering.twist

    def _give_up(self, reason: Reason, why: str) -> None:
        assert self.pursuit is not None
        self.looks.note(self.pursuit.goal.frontier, reason, why, self.grid)
        self._events.append(f"gave up {self.pursuit.goal}: {why}")
        self.pursuit = None

    def _twist_of(self, seen: Observation) -> Twist2:
        """The robot's own motion, as its odometry has it since the last scan."""
        last = self._last_seen
        if last is None or seen.time_s <= last.time_s:
            return Twist2.zero()
        moved = last.odom_from_robot.inverse() @ seen.odom_from_robot
        dt_s = seen.time_s - last.time_s
        return Twist2(moved.x_m / dt_s, moved.yaw_rad / dt_s)
