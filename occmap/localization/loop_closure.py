"""Loop closures: which submaps may be the same place, whether they are, and how surely."""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.localization.matcher import Match, Matcher
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.localization.submap import Cloud, Submap


@dataclass(frozen=True)
class LoopClosureConfig:
    """Where loops are looked for and what they must show."""

    near_m: float = 4.0
    """Submaps whose centres are this near (plus their uncertainty) may show the same place."""
    candidates: int = 6
    """A finished submap is compared with so many others, nearest first."""
    apart: int = 3
    """Of a run of consecutive submaps one in so many is compared."""
    window_m: float = 0.3
    """A search looks this far beyond three standard deviations."""
    window_rad: float = 0.06
    """And turns this far beyond."""
    max_window_m: float = 12.0
    """But never farther: a loop lost by more is not found."""
    max_window_rad: float = 0.8
    """And never turns farther."""
    sure_m: float = 0.5
    """A loop whose prediction has a smaller standard deviation needs no witness."""
    query_radius_m: float = 10.0
    """Surfels this near to a submap's centre are searched with."""
    query_spacing_m: float = 0.25
    """And so far apart."""
    least_score: float = 0.45
    """Mean of the raster's likelihood that a search must reach."""
    least_fit: float = 0.5
    """Share of the surfels that must lie on the other submap after refinement."""
    most_conflict: float = 0.10
    """Share of the points that the other submap may have looked through."""
    floor_m: float = 0.01
    """Standard deviation of a loop however many points agree."""
    floor_rad: float = 0.003
    """The same, of its turn."""
    dcs_chi2: float = 6.0
    """Loops that disagree more than this lose weight (dynamic covariance scaling)."""


@dataclass(frozen=True)
class Loop:
    """Two submaps seen to be the same place: older_from_younger."""

    older: int
    younger: int
    older_from_younger: Pose2
    information: NDArray[np.float64]  # (3, 3) in the younger's frame
    fit: float
    sigma_m: float
    """Standard deviation of the prediction when it was found."""
    conflict: float = 0.0
    score: float = 0.0


class LoopCloser:
    def __init__(
        self, config: LoopClosureConfig, matcher: Matcher, graph: PoseGraph, submaps: list[Submap]
    ) -> None:
        self.config = config
        self._matcher = matcher
        self._graph = graph
        self._submaps = submaps
        self._queue: deque[tuple[int, int, float, float]] = deque()
        self._built: OrderedDict[int, None] = OrderedDict()
        self.log: list = []
        self.pending: list[Loop] = []

    def propose(self, younger: int) -> None:
        """Queue the candidates of a submap that has just been finished."""
        var_m2, var_rad2 = self._uncertainty(younger)
        c = self.config
        here = self._centre(younger)
        ranked = []
        for k in range(younger - 1):
            sigma = math.sqrt(var_m2[k])
            distance = math.dist(here, self._centre(k))
            if distance < c.near_m + 2.0 * sigma:
                ranked.append((distance, k, sigma, math.sqrt(var_rad2[k])))
        chosen: list[int] = []
        for _, k, sigma, sigma_rad in sorted(ranked):
            if all(abs(k - other) >= c.apart for other in chosen):
                chosen.append(k)
                self._queue.append((k, younger, sigma, sigma_rad))
                if len(chosen) == c.candidates:
                    break

    @property
    def busy(self) -> bool:
        return bool(self._queue)

    def step(self) -> bool:
        """Compare one pair; True if the graph has new edges."""
        if not self._queue:
            return False
        loop = self._compare(*self._queue.popleft())
        if loop is None:
            return False
        believed = [loop] if loop.sigma_m < self.config.sure_m else self._witnessed(loop)
        for each in believed:
            self._graph.add_edge(
                each.older,
                each.younger,
                each.older_from_younger,
                each.information,
                Loss.DCS,
                self.config.dcs_chi2,
            )
        return bool(believed)

    def _witnessed(self, loop: Loop) -> list[Loop]:
        """Loops from an uncertain place are believed once two of them tell the same story."""
        friends = [other for other in self.pending if self._consistent(loop, other)]
        if not friends:
            self.pending.append(loop)
            return []
        self.pending = [other for other in self.pending if other not in friends]
        return [loop, *friends]

    def _consistent(self, a: Loop, b: Loop) -> bool:
        if a.younger == b.younger and a.older == b.older:
            return False
        if abs(a.younger - b.younger) > 12 or abs(a.older - b.older) > 12:
            return False
        pose = self._graph.pose
        older = pose(a.older).inverse() @ pose(b.older)
        younger = pose(a.younger).inverse() @ pose(b.younger)
        round_trip = a.older_from_younger @ younger @ b.older_from_younger.inverse() @ older.inverse()
        steps = abs(a.younger - b.younger) + abs(a.older - b.older)
        return (
            math.hypot(round_trip.x_m, round_trip.y_m) < 0.2 + 0.05 * steps
            and abs(round_trip.yaw_rad) < 0.05 + 0.01 * steps
        )

    def _compare(self, older: int, younger: int, sigma_m: float, sigma_rad: float) -> Loop | None:
        c = self.config
        target, query = self._submaps[older], self._submaps[younger]
        guess = self._graph.pose(older).inverse() @ self._graph.pose(younger)
        sparse = near(query, c.query_radius_m, c.query_spacing_m).points
        # turn about the query's centre, not its origin
        window_m = min(3.0 * sigma_m + c.window_m, c.max_window_m)
        window_rad = min(3.0 * sigma_rad + c.window_rad, c.max_window_rad)
        self._use(older)
        found, score = self._matcher.search(
            sparse, target, guess, window_m, window_rad, 0.005, least_score=c.least_score
        )
        if score <= c.least_score:
            self.log.append((older, younger, sigma_m, window_m, score, 0, 0, False))
            return None
        match = self._matcher.refine(near(query, c.query_radius_m, 0.1), target, found, found, np.eye(3) * 1e-3)
        conflict = self._conflict(target, query, match.submap_from_robot)
        ok = match.fit >= c.least_fit and conflict <= c.most_conflict
        self.log.append((older, younger, sigma_m, window_m, score, match.fit, conflict, ok))
        if not ok:
            return None
        return Loop(
            older,
            younger,
            match.submap_from_robot,
            self._information(match),
            match.fit,
            sigma_m,
            conflict,
            score,
        )

    def _information(self, match: Match) -> NDArray[np.float64]:
        c = self.config
        floor = np.diag([c.floor_m**2, c.floor_m**2, c.floor_rad**2])
        h = match.information @ np.linalg.inv(np.eye(3) + floor @ match.information)
        yaw = match.submap_from_robot.yaw_rad
        axes = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1.0]])
        h = axes.T @ h @ axes
        return 0.5 * (h + h.T)

    def _conflict(self, target: Submap, query: Submap, target_from_query: Pose2) -> float:
        from occmap.localization import visibility_kernels as kernels

        seen = through = 0
        for submap, other, submap_from_other in (
            (target, query, target_from_query), (query, target, target_from_query.inverse())
        ):  # fmt: skip
            points = submap_from_other.apply(near(other, self.config.query_radius_m, 0.2).points)
            a, b = kernels.count(points, submap.views_array, submap.view_ranges, submap.view_bearings)
            seen, through = seen + a, through + b
        return through / max(1, seen + through)

    def _use(self, submap: int) -> None:
        """Keep the working memory of the submaps used last only."""
        self._built[submap] = None
        self._built.move_to_end(submap)
        if len(self._built) > 24:
            self._submaps[self._built.popitem(last=False)[0]].release()

    def _centre(self, k: int) -> tuple[float, float]:
        p = self._graph.pose(k).apply(np.array([self._submaps[k].centre]))[0]
        return float(p[0]), float(p[1])

    def _uncertainty(self, source: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,) variances of every submap's position and yaw seen from one (Bosse et al. 2004).

        Along the surest path of edges; an edge's turn moves the source by its distance to the edge.
        """
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import dijkstra

        graph = self._graph
        n, ends = len(graph.poses), graph.ends
        info = graph.information
        alive = info[:, 2, 2] > 0
        ends, info = ends[alive], info[alive]
        covariance = np.linalg.inv(info + 1e-6 * np.eye(3))
        var_m2 = covariance[:, 0, 0] + covariance[:, 1, 1]
        var_rad2 = covariance[:, 2, 2]
        xy = graph.poses[:, :2]
        middle = 0.5 * (xy[ends[:, 0]] + xy[ends[:, 1]])
        cost = var_m2 + var_rad2 * ((middle - xy[source]) ** 2).sum(axis=1)
        order = np.lexsort((cost, ends[:, 1], ends[:, 0]))
        key = ends[order, 0] * n + ends[order, 1]
        order = order[np.concatenate(([True], key[1:] != key[:-1]))] if len(order) else order
        weights = csr_matrix((cost[order], (ends[order, 0], ends[order, 1])), shape=(n, n))
        yaw = csr_matrix((var_rad2[order], (ends[order, 0], ends[order, 1])), shape=(n, n))
        distance, before = dijkstra(weights, directed=False, indices=source, return_predecessors=True)
        yaw = (yaw + yaw.T).tocsr()
        total = np.zeros(n)
        rank = np.argsort(distance, kind="stable")
        step = np.asarray(yaw[before[rank[1:]], rank[1:]]).ravel() if n > 1 else np.zeros(0)
        for k, s in zip(rank[1:], step, strict=True):
            total[k] = total[before[k]] + s
        return distance, total


def near(submap: Submap, radius_m: float, spacing_m: float) -> Cloud:
    """The surfels seen at least twice, near the submap's centre; of each square of side spacing_m the surest."""
    rows = submap.cloud
    assert rows is not None
    offset = rows[:, :2] - np.asarray(submap.centre)
    rows = rows[((offset * offset).sum(axis=1) < radius_m * radius_m) & (rows[:, 5] >= 2.0)]
    rows = rows[np.argsort(-rows[:, 5], kind="stable")]
    key = np.floor(rows[:, :2] / spacing_m).astype(np.int64)
    _, first = np.unique(key[:, 0] * 1_000_003 + key[:, 1], return_index=True)
    rows = rows[np.sort(first)]
    facing = np.where(rows[:, 4:5] > 0.5, rows[:, 2:4], rows[:, 6:8])
    return Cloud(np.ascontiguousarray(rows[:, :2]), np.ascontiguousarray(facing))
