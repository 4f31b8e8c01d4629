"""Loop closures: whether two submaps show the same place, and how surely."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.geometry import Points, Pose2
from occmap.localization.loop_candidates import Candidate, CandidateConfig, candidates
from occmap.localization.loop_comparison import Comparison, ComparisonConfig, centre_of_sight
from occmap.localization.matcher import Match, Matcher, axes
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.localization.ready_submaps import ReadySubmaps
from occmap.localization.submap import Submap

HOME_M, HOME_M_PER_STEP, HOME_AT_MOST_M = 0.1, 0.03, 0.5
"""Out by one loop and back by another that agrees leads so near to where one began; the errors of the edges
in between may add so much for each submap, but no more than to this."""
HOME_RAD, HOME_RAD_PER_STEP, HOME_AT_MOST_RAD = 0.03, 0.005, 0.1
"""The same, of the turn."""


@dataclass(frozen=True)
class LoopClosureConfig(Positive):
    """Where loops are looked for and when they are believed."""

    candidates: CandidateConfig = field(default_factory=CandidateConfig)
    comparison: ComparisonConfig = field(default_factory=ComparisonConfig)
    work_per_turn: int = 4_000_000
    """Points looked up in one turn of the robot: some milliseconds."""
    most_waiting: int = 60
    """Pairs that wait to be compared while the robot drives; the oldest are dropped. In the end, submaps that
    are far from any loop are compared once more."""
    sure_m: float = 0.5
    """A loop less well predicted than this (standard deviation) needs a witness."""
    surprise: float = 3.0
    """So does one that is so many standard deviations off its prediction. A witness has other views: that one
    submap fits two older ones of a place says no more than that it fits one, for all corridors look alike."""
    witness_apart: int = 2
    """Where a loop surprises, these begin at least so many submaps earlier or later, and share nothing."""
    witness_within: int = 40
    """A witness is a loop between submaps at most so many earlier or later, at both ends."""
    floor_m: float = 0.01
    """Standard deviation of a loop, however many points agree."""
    floor_rad: float = 0.003
    """The same, of its turn."""
    dcs_chi2: float = 6.0
    """Loops that disagree more than this lose weight (dynamic covariance scaling)."""
    submaps_in_memory: int = 24
    """So many submaps stay ready to be searched; others are made ready when needed."""


@dataclass(frozen=True, eq=False)
class Loop:
    """Two submaps that look like the same place."""

    older: int
    younger: int
    older_from_younger: Pose2
    information: NDArray[np.float64]  # (3, 3) of x, y, yaw in the younger's frame
    is_sure: bool
    is_surprise: bool


class LoopCloser:
    """Compares submaps pair by pair, and adds to the pose graph the loops that it believes."""

    def __init__(
        self, config: LoopClosureConfig, matcher: Matcher, graph: PoseGraph, submaps: list[Submap]
    ) -> None:
        self.config = config
        self.waiting: deque[Candidate] = deque()
        self.unwitnessed: list[Loop] = []
        self.believed: list[Loop] = []
        self._matcher, self._graph, self._submaps = matcher, graph, submaps
        self._comparing: Comparison | None = None
        self._sights: dict[int, Points] = {}  # centres of sight, in the submaps' frames
        self.ready = ReadySubmaps(submaps, config.submaps_in_memory)

    @property
    def is_busy(self) -> bool:
        """Whether pairs are left to be compared."""
        return bool(self.waiting) or self._comparing is not None

    def propose(self, submap: int) -> None:
        """Queue the comparisons of a finished submap with those before it, unless that was done."""
        if submap not in self._sights:
            self._queue(submap)
            while len(self.waiting) > self.config.most_waiting:
                self.waiting.pop()

    def propose_lonely(self) -> None:
        """Queue once more the finished submaps far from any loop."""
        apart = self.config.candidates.apart
        near = {
            k + d for loop in self.believed for k in (loop.older, loop.younger) for d in range(-apart, apart)
        }
        for k, submap in enumerate(self._submaps):
            if k not in near and submap.cloud is not None:
                self._queue(k)
                near.update(range(k, k + apart))

    def _queue(self, submap: int) -> None:
        for k in range(submap + 1):
            if k not in self._sights and self._submaps[k].cloud is not None:
                self._sights[k] = centre_of_sight(self._submaps[k], self.config.comparison)
        sights = np.array([self._sights[k] for k in range(submap + 1)])
        x, y, yaw = self._graph.poses[: submap + 1].T
        c, s = np.cos(yaw), np.sin(yaw)
        sights_in_map = np.column_stack(
            (x + c * sights[:, 0] - s * sights[:, 1], y + s * sights[:, 0] + c * sights[:, 1])
        )
        after_gap = max((k for k in range(submap + 1) if self._submaps[k].is_after_gap), default=0)
        found = candidates(self.config.candidates, self._graph, sights_in_map, submap, after_gap)
        self.waiting.extendleft(reversed(found))  # where the robot is now comes first

    def step(self) -> bool:
        """Do a turn's part of the comparisons; True if the graph has new edges."""
        if self._comparing is None:
            if not self.waiting:
                return False
            self._comparing = self._begin(self.waiting.popleft())
        now = self._comparing
        older, younger = self.ready.use(now.pair.older), self._submaps[now.pair.younger]
        if not now.step(older, younger, self._matcher, self.config.work_per_turn):
            return False
        self._comparing = None
        return now.match is not None and self._judge(now, now.match)

    def _begin(self, pair: Candidate) -> Comparison:
        predicted = self._from(pair.older, pair.younger)
        return Comparison(self.config.comparison, pair, self._submaps[pair.younger], predicted)

    def _judge(self, compared: Comparison, match: Match) -> bool:
        """Believe what was found, at once or with its witnesses; True if the graph has new edges."""
        pair, c = compared.pair, self.config
        off = compared.predicted.inverse() @ match.submap_from_robot
        surprise_m = math.hypot(off.x_m, off.y_m) / (pair.sigma_m + c.floor_m)
        surprise_rad = abs(off.yaw_rad) / (pair.sigma_rad + c.floor_rad)
        is_surprise = max(surprise_m, surprise_rad) >= c.surprise
        is_sure = pair.sigma_m < c.sure_m and not is_surprise
        information = self._information(match)
        self.unwitnessed = [
            other for other in self.unwitnessed if (other.older, other.younger) != (pair.older, pair.younger)
        ]
        loop = Loop(pair.older, pair.younger, match.submap_from_robot, information, is_sure, is_surprise)
        return self._believe([loop] if loop.is_sure else self._with_witnesses(loop))

    def _believe(self, loops: list[Loop]) -> bool:
        for each in loops:
            self._graph.add_edge(
                each.older,
                each.younger,
                each.older_from_younger,
                each.information,
                Loss.DCS,
                self.config.dcs_chi2,
                is_graduated=True,
            )
        self.believed += loops
        return bool(loops)

    def _information(self, match: Match) -> NDArray[np.float64]:
        """The match's information in the younger's axes, bounded by the floor."""
        floor = np.diag([self.config.floor_m**2, self.config.floor_m**2, self.config.floor_rad**2])
        turned = axes(match.submap_from_robot.yaw_rad)
        information = turned.T @ match.information @ turned
        bounded = information @ np.linalg.inv(np.eye(3) + floor @ information)
        return 0.5 * (bounded + bounded.T)

    def _with_witnesses(self, loop: Loop) -> list[Loop]:
        """The loop and those that tell the same story; if none does, the loop waits."""
        witnesses = [other for other in self.unwitnessed if self.agree(loop, other)]
        if not witnesses:
            self.unwitnessed.append(loop)
            return []
        self.unwitnessed = [other for other in self.unwitnessed if other not in witnesses]
        return [loop, *witnesses]

    def _from(self, a: int, b: int) -> Pose2:
        """a_from_b of two submaps, as the graph has it."""
        return self._graph.pose(a).inverse() @ self._graph.pose(b)

    def agree(self, a: Loop, b: Loop) -> bool:
        """Whether two loops tell the same story: going out by one and back by the other leads home."""
        steps_younger, steps_older = abs(a.younger - b.younger), abs(a.older - b.older)
        if steps_younger + steps_older == 0 or max(steps_younger, steps_older) > self.config.witness_within:
            return False
        if steps_younger < (self.config.witness_apart if a.is_surprise or b.is_surprise else 1):
            return False
        older, younger = self._from(a.older, b.older), self._from(a.younger, b.younger)
        home = a.older_from_younger @ younger @ b.older_from_younger.inverse() @ older.inverse()
        steps = steps_younger + steps_older
        near_m = min(HOME_M + HOME_M_PER_STEP * steps, HOME_AT_MOST_M)
        near_rad = min(HOME_RAD + HOME_RAD_PER_STEP * steps, HOME_AT_MOST_RAD)
        return math.hypot(home.x_m, home.y_m) < near_m and abs(home.yaw_rad) < near_rad
