"""Loop closures: whether two submaps show the same place, and how surely."""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2
from occmap.localization.loop_candidates import Candidate, CandidateConfig, candidates
from occmap.localization.matcher import Match, Matcher, Search, axes
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.localization.positive import Positive
from occmap.localization.submap import Submap, share_seen_through
from occmap.localization.surfel_map import Cloud


@dataclass(frozen=True)
class LoopClosureConfig(Positive):
    """Where loops are looked for and what they must show."""

    candidates: CandidateConfig = field(default_factory=CandidateConfig)
    window_m: float = 0.3
    """A search looks this far beyond three standard deviations."""
    window_rad: float = 0.06
    """And turns this far beyond."""
    max_window_m: float = 12.0
    """But never farther: a loop lost by more is not found."""
    max_window_rad: float = 0.8
    """And never turns farther."""
    turn_step_rad: float = 0.005
    """Between two orientations searched: half a cell at five metres."""
    query_radius_m: float = 10.0
    """Surfels this near to a submap's centre are compared."""
    query_spacing_m: float = 0.25
    """So far apart in the search."""
    refine_spacing_m: float = 0.10
    """And so far apart in the refinement."""
    least_points: int = 50
    """A submap of fewer surfels than this is too empty to be recognised."""
    least_score: float = 0.45
    """Mean likelihood on the raster that a search must reach."""
    rival_m: float = 0.5
    """In a wider window, no pose so far from the best one may score nearly as well: a corridor with a door
    every few metres looks the same a few metres on."""
    rival_share: float = 0.8
    """Of the best score, that a rival has."""
    least_fit: float = 0.5
    """Share of the surfels that must lie on the other submap after refinement."""
    most_seen_through: float = 0.10
    """Share of either's points that the other may have looked straight through."""
    sure_m: float = 0.5
    """A loop less well predicted than this (standard deviation) needs a witness."""
    surprise: float = 4.0
    """So does one that is so many standard deviations off its prediction."""
    witness_within: int = 12
    """A witness is a loop between submaps at most so many earlier or later, at both ends."""
    floor_m: float = 0.01
    """Standard deviation of a loop, however many points agree."""
    floor_rad: float = 0.003
    """The same, of its turn."""
    dcs_chi2: float = 6.0
    """Loops that disagree more than this lose weight (dynamic covariance scaling)."""
    submaps_in_memory: int = 24
    """So many submaps stay ready to be searched; others are made ready when needed."""


@dataclass(frozen=True)
class Loop:
    """Two submaps that look like the same place."""

    older: int
    younger: int
    older_from_younger: Pose2
    information: NDArray[np.float64]  # (3, 3) of x, y, yaw in the younger's frame
    is_sure: bool


class LoopCloser:
    """Compares submaps one pair a turn, and adds to the pose graph the loops that it believes."""

    def __init__(
        self, config: LoopClosureConfig, matcher: Matcher, graph: PoseGraph, submaps: list[Submap]
    ) -> None:
        self.config = config
        self.waiting: deque[Candidate] = deque()
        self.unwitnessed: list[Loop] = []
        self.believed: list[Loop] = []
        self._matcher, self._graph, self._submaps = matcher, graph, submaps
        self._proposed: set[int] = set()
        self._ready: OrderedDict[int, None] = OrderedDict()

    def propose(self, submap: int) -> None:
        """Queue the comparisons of a finished submap with those before it, unless that was done."""
        if submap not in self._proposed:
            self._proposed.add(submap)
            self._queue(submap)

    def _queue(self, submap: int) -> None:
        centres = np.array([each.centre for each in self._submaps])
        poses = self._graph.poses
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        turned = np.column_stack(
            (c * centres[:, 0] - s * centres[:, 1], s * centres[:, 0] + c * centres[:, 1])
        )
        centres_in_map = poses[:, :2] + turned
        self.waiting.extend(candidates(self.config.candidates, self._graph, centres_in_map, submap))

    def propose_lonely(self) -> None:
        """Queue once more the finished submaps that no loop has been found for."""
        found = {k for loop in self.believed for k in (loop.older, loop.younger)}
        for k, submap in enumerate(self._submaps):
            if k not in found and submap.cloud is not None:
                self._queue(k)

    def step(self) -> bool:
        """Compare one pair, if any waits; True if the graph has new edges."""
        loop = self._compare(self.waiting.popleft()) if self.waiting else None
        if loop is None:
            return False
        believed = [loop] if loop.is_sure else self._with_witnesses(loop)
        for each in believed:
            self._graph.add_edge(
                each.older,
                each.younger,
                each.older_from_younger,
                each.information,
                Loss.DCS,
                self.config.dcs_chi2,
            )
        self.believed += believed
        return bool(believed)

    def _compare(self, pair: Candidate) -> Loop | None:
        """Search, refine, and look through: None if these are not seen to be the same place."""
        c = self.config
        older, younger = self._submaps[pair.older], self._submaps[pair.younger]
        self._make_ready(pair.older)
        predicted = self._graph.pose(pair.older).inverse() @ self._graph.pose(pair.younger)
        cloud = near(younger, c.query_radius_m, c.refine_spacing_m)
        if len(cloud.points) < c.least_points:
            return None
        sparse = near(younger, c.query_radius_m, c.query_spacing_m).points
        where = Search(
            predicted,
            min(3.0 * pair.sigma_m + c.window_m, c.max_window_m),
            min(3.0 * pair.sigma_rad + c.window_rad, c.max_window_rad),
            c.turn_step_rad,
            least_score=c.least_score,
        )
        found, score = self._matcher.search(sparse, older, where)
        if score <= c.least_score or self._has_rival(sparse, older, where, found, score):
            return None
        match = self._matcher.refine(cloud, older, found, found, 1e-3 * np.eye(3))
        if match.fit < c.least_fit or self._seen_through(older, younger, match) > c.most_seen_through:
            return None
        off = predicted.inverse() @ match.submap_from_robot
        surprise = math.hypot(off.x_m, off.y_m) / (pair.sigma_m + c.floor_m)
        is_sure = pair.sigma_m < c.sure_m and surprise < c.surprise
        return Loop(pair.older, pair.younger, match.submap_from_robot, self._information(match), is_sure)

    def _has_rival(self, points: Points, submap: Submap, where: Search, found: Pose2, score: float) -> bool:
        """Whether another place in a wide window looks nearly as good."""
        c = self.config
        if where.window_m <= c.rival_m:
            return False
        nearly = c.rival_share * score
        elsewhere = replace(where, least_score=nearly, shun=found, shun_m=c.rival_m)
        return self._matcher.search(points, submap, elsewhere)[1] > nearly

    def _seen_through(self, older: Submap, younger: Submap, match: Match) -> float:
        """The larger share of either submap's points that the other has looked straight through."""
        c, older_from_younger = self.config, match.submap_from_robot
        ours = near(younger, c.query_radius_m, c.query_spacing_m).moved(older_from_younger).points
        theirs = near(older, c.query_radius_m, c.query_spacing_m).moved(older_from_younger.inverse()).points
        return max(share_seen_through(older, ours), share_seen_through(younger, theirs))

    def _information(self, match: Match) -> NDArray[np.float64]:
        """The match's information in the younger's axes, bounded by the floor."""
        floor = np.diag([self.config.floor_m**2, self.config.floor_m**2, self.config.floor_rad**2])
        turned = axes(match.submap_from_robot.yaw_rad)
        information = turned.T @ match.information @ turned
        bounded = information @ np.linalg.inv(np.eye(3) + floor @ information)
        return 0.5 * (bounded + bounded.T)

    def _with_witnesses(self, loop: Loop) -> list[Loop]:
        """The loop and those that tell the same story; none, and the loop waits, if nobody does."""
        witnesses = [other for other in self.unwitnessed if self._agree(loop, other)]
        if not witnesses:
            self.unwitnessed.append(loop)
            return []
        self.unwitnessed = [other for other in self.unwitnessed if other not in witnesses]
        return [loop, *witnesses]

    def _agree(self, a: Loop, b: Loop) -> bool:
        """Whether going out by one loop and back by the other leads home."""
        steps_younger, steps_older = abs(a.younger - b.younger), abs(a.older - b.older)
        if steps_younger + steps_older == 0 or max(steps_younger, steps_older) > self.config.witness_within:
            return False
        pose = self._graph.pose
        older = pose(a.older).inverse() @ pose(b.older)
        younger = pose(a.younger).inverse() @ pose(b.younger)
        home = a.older_from_younger @ younger @ b.older_from_younger.inverse() @ older.inverse()
        steps = steps_younger + steps_older
        return (
            math.hypot(home.x_m, home.y_m) < 0.1 + 0.03 * steps and abs(home.yaw_rad) < 0.03 + 0.005 * steps
        )

    def _make_ready(self, submap: int) -> None:
        """Keep the working memory of those used last only."""
        self._ready[submap] = None
        self._ready.move_to_end(submap)
        if len(self._ready) > self.config.submaps_in_memory:
            self._submaps[self._ready.popitem(last=False)[0]].release()


def near(submap: Submap, radius_m: float, spacing_m: float) -> Cloud:
    """The surfels seen at least twice, near the submap's centre; the surest of each square of this side."""
    rows = submap.cloud
    assert rows is not None
    offset = rows[:, :2] - np.asarray(submap.centre)
    rows = rows[((offset * offset).sum(axis=1) < radius_m * radius_m) & (rows[:, 5] >= 2.0)]
    rows = rows[np.argsort(-rows[:, 5], kind="stable")]
    square = np.floor(rows[:, :2] / spacing_m).astype(np.int64)
    _, first = np.unique(square[:, 0] * 1_000_003 + square[:, 1], return_index=True)
    rows = rows[np.sort(first)].astype(np.float64)
    facing = np.where(rows[:, 4:5] > 0.5, rows[:, 2:4], rows[:, 6:8])
    points = np.ascontiguousarray(rows[:, :2])
    return Cloud(points, np.ascontiguousarray(facing), points)
