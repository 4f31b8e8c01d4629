"""A goal being driven to and looked at, and when to give it up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from occmap.body import Body
from occmap.config_checks import NeverNegative
from occmap.decision import Reason
from occmap.follower import Steering
from occmap.geometry import Pose2, Twist2
from occmap.goals import SAME_GOAL_M, Goal
from occmap.grid import OccupancyGrid
from occmap.memory import known_around
from occmap.path import Path

SAME_VIEWPOINT_M = 0.3
"""A path that ends this near to a viewpoint leads to it."""
STRAYED_M = 0.4
"""Farther beside its path the robot plans anew."""
NEARER_M = 0.05
"""Less of a gain on the goal is none."""
LEARNT_M2 = 0.25
"""Less that has become known is noise."""


@dataclass(frozen=True)
class PursuitConfig(NeverNegative):
    """How long a goal is worth pursuing."""

    look_s: float = 0.6
    """At a viewpoint the robot waits this long for its frontier to be resolved."""
    look_turn_radps: float = 0.1
    """Meanwhile it turns a little, so that its beams sweep over what lay between them."""
    held_up_s: float = 4.0
    """Something in the scan that bars the way for this long makes a goal unsafe."""
    patience_s: float = 10.0
    """A goal that comes no nearer for this long is given up."""
    fruitless_s: float = 60.0
    """Nothing new learnt for so long, besides the time to drive the longest way meanwhile: the goal of
    the moment is given up, however often it was replaced or planned to anew."""
    slowest_mps: float = 0.25
    """What counts as that time, or half of what the base does: ways lead through gaps and round bends."""
    turns_back: int = 3
    """A goal left so often for another, with nothing new learnt meanwhile, is given up: the way to it
    opens and closes with the noise."""
    gaps_tried: int = 6
    """A goal on the way to which so many gaps have held the robot up, with nothing new learnt meanwhile, is
    given up."""
    seen_something_m2: float = 0.02
    """A look that made so much around its frontier known was not in vain."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.slowest_mps == 0.0:
            raise ValueError("slowest_mps must be positive, got 0.0")


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a goal was given up."""

    reason: Reason
    why: str  # for a person


class Pursuit:
    """One goal and the path to it; remembers how far the robot has come, and since when it gets no nearer."""

    def __init__(
        self,
        config: PursuitConfig,
        goal: Goal,
        path: Path,
        grid: OccupancyGrid,
        now_s: float,
        is_tight: bool = False,
    ) -> None:
        self.config = config
        self.goal = goal
        self._place = goal.frontier.centroid_in_map
        self._known_cells = known_around(self._place, grid)
        self.path = path
        self.is_tight = is_tight  # the path leads through a gap that may be too narrow
        self.progress_m = 0.0  # along the path
        self.is_void = False
        """The robot is not where the path is, or cannot follow it: another is needed."""
        self.is_over = False
        self._to_go_m = math.inf  # at best so far
        self._nearer_s = now_s  # when that last shrank
        self._arrived_s: float | None = None
        self._held_up_s = 0.0

    @property
    def has_arrived(self) -> bool:
        """Whether the robot has come to the viewpoint."""
        return self._arrived_s is not None

    @property
    def way_left_m(self) -> float:
        """Metres of the path ahead of the robot."""
        return self.path.length_m - self.progress_m

    def leads_to(self, goal: Goal) -> bool:
        """Whether the path still leads to where a goal wants to be looked at from."""
        return not self.is_void and math.dist(self.path.goal, goal.viewpoint_in_map) < SAME_VIEWPOINT_M

    def has_shown_something(self, grid: OccupancyGrid) -> bool:
        """Whether more is known around the frontier now than when the robot set out for it."""
        learnt = known_around(self._place, grid) - self._known_cells
        return learnt >= max(1, round(self.config.seen_something_m2 / grid.frame.resolution_m**2))

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map: the goal does, the path is to be planned anew."""
        self.goal = self.goal.carried(new_map_from_old_map)
        self.is_void = True

    def advance(self, steering: Steering, now_s: float) -> Twist2:
        """Take in where the robot is on its path: the twist to drive on with, or to look around with."""
        self.progress_m = steering.progress_m
        self.is_void = self.is_void or steering.off_path_m > STRAYED_M
        self._held_up_s = steering.held_up_s
        to_go_m = self.path.length_m - steering.progress_m
        if to_go_m < self._to_go_m - NEARER_M:
            self._to_go_m, self._nearer_s = to_go_m, now_s
        if steering.arrived and self._arrived_s is None:
            self._arrived_s = now_s
        return Twist2(0.0, self.config.look_turn_radps) if steering.arrived else steering.twist

    def failure(self, here: Pose2, now_s: float) -> Failure | None:
        """The failure, if the goal should be given up."""
        c, (x, y) = self.config, here.position
        if self._arrived_s is not None:
            if now_s - self._arrived_s >= c.look_s:
                return Failure(Reason.GAVE_UP, f"looked at it from ({x:.2f}, {y:.2f}) in vain")
        elif self._held_up_s > c.held_up_s:
            return Failure(self._obstacle, f"something bars the way at ({x:.2f}, {y:.2f})")
        elif now_s - self._nearer_s > c.patience_s:
            return Failure(self._obstacle, f"came no nearer than {self._to_go_m:.2f} m")
        return None

    @property
    def _obstacle(self) -> Reason:
        """Why the robot is held up: a gap that only looked passable on the grid, or something else."""
        return Reason.TOO_NARROW if self.is_tight else Reason.UNSAFE


class Learning:
    """How long the robot has been on its way without learning anything, over all its goals."""

    def __init__(self, config: PursuitConfig, body: Body) -> None:
        self.config = config
        self._slowest_mps = min(config.slowest_mps, 0.5 * body.max_speed_mps)
        self._known_m2 = 0.0
        self._since_s = 0.0
        self._longest_m = 0.0
        self._left: list[tuple[float, float]] = []  # the middles of the frontiers turned back from
        self._barred: list[tuple[float, float]] = []  # and of those on the way to which a gap was in the way

    def note(self, known_m2: float, way_m: float, now_s: float) -> None:
        """Take in how much of the map is known, and the length of the way just chosen."""
        if known_m2 >= self._known_m2 + LEARNT_M2:
            self._known_m2 = known_m2
            self._left.clear()
            self._barred.clear()
            self.begin(now_s)
        self._longest_m = max(self._longest_m, way_m)

    def carry_over(self, new_map_from_old_map: Pose2, known_m2: float) -> None:
        """Follow a correction of the map: what was mapped twice may have become one, and less."""
        self._known_m2 = min(self._known_m2, known_m2)
        for places in (self._left, self._barred):
            moved = new_map_from_old_map.apply(np.array(places, float).reshape(-1, 2))
            places[:] = [(float(x), float(y)) for x, y in moved]

    def begin(self, now_s: float) -> None:
        """Start counting afresh."""
        self._since_s, self._longest_m = now_s, 0.0

    def turned_back(self, pursuit: Pursuit) -> Failure | None:
        """Take in that a goal is left for another on the way; what is wrong with it if that recurs."""
        place = pursuit.goal.frontier.centroid_in_map
        if not _recurs(place, self._left, self.config.turns_back):
            return None
        times = self.config.turns_back
        reason = Reason.TOO_NARROW if pursuit.is_tight else Reason.GAVE_UP
        return Failure(reason, f"turned back on the way {times} times")

    def is_barred(self, pursuit: Pursuit) -> bool:
        """Take in that something bars the way to a goal; whether that has happened too often."""
        return _recurs(pursuit.goal.frontier.centroid_in_map, self._barred, self.config.gaps_tried)

    def failure(self, now_s: float) -> Failure | None:
        """The failure, if nothing was learnt for too long."""
        fruitless_s = now_s - self._since_s
        if fruitless_s <= self.config.fruitless_s + self._longest_m / self._slowest_mps:
            return None
        return Failure(Reason.GAVE_UP, f"nothing new was learnt in {fruitless_s:.0f} s of trying")


def _recurs(place: tuple[float, float], places: list[tuple[float, float]], times: int) -> bool:
    """Note a place; whether it has been noted so many times, which then count no more."""
    places.append(place)
    here = [other for other in places if math.dist(place, other) < SAME_GOAL_M]
    if len(here) < times:
        return False
    places[:] = [other for other in places if other not in here]
    return True
