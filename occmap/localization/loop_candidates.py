"""Which submaps may show the same place: near each other, given how uncertain that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.localization.pose_graph import PoseGraph

Floats = NDArray[np.float64]

LEAST_WEIGHT = 0.25
"""An edge that its loss leaves less of is not believed, and makes nothing certain."""
SURELY_REGULAR = 1e-6 * np.eye(3)
"""Added to an edge's information, which may tell nothing along a corridor, so that it can be inverted."""


@dataclass(frozen=True)
class CandidateConfig(Positive):
    """Where loops are looked for."""

    near_m: float = 4.0
    """Submaps whose centres are this near, plus twice the uncertainty, may show the same place."""
    most: int = 6
    """A submap is compared with so many others, nearest first."""
    apart: int = 3
    """Of a run of consecutive submaps one in so many is compared: they show the same."""
    lost_m: float = 1.0
    """Where the relative pose is less well known than this (standard deviation), others are compared that lie
    farther apart from each other, for each is searched widely."""
    lost_most: int = 10
    """And more of them."""
    lost_apart_m: float = 2.0
    """And so far apart."""
    gap: int = 8
    """Submaps nearer in time than this share too much to tell anything new about each other."""
    common_share: float = 0.15
    """Of the errors from submap to submap, that all have in common (a lidar that sits askew, a wheel that is
    too small): these do not average out over a long way, they add up."""
    compass_rad: float = 0.01
    """Standard deviation of a heading that the compass knows, wherever it is: walls run a little askew."""


@dataclass(frozen=True)
class Candidate:
    """Two submaps to compare, and how well their relative pose is known already."""

    older: int
    younger: int
    sigma_m: float
    sigma_rad: float


def candidates(
    config: CandidateConfig, graph: PoseGraph, centres_in_map: Floats, younger: int, after_gap: int = 0
) -> list[Candidate]:
    """The submaps before `younger` worth comparing with it. centres_in_map is (younger + 1, 2).

    `after_gap` is the last submap up to it that nothing was tracked to: of those before it, even the
    latest tell something new.
    """
    var_m2, var_rad2 = uncertainty_from(graph, younger, config.common_share, config.compass_rad)
    sigma_m, sigma_rad = np.sqrt(var_m2), np.sqrt(var_rad2)
    away_m = np.hypot(*(centres_in_map - centres_in_map[younger]).T)
    chosen: list[int] = []
    for k in np.argsort(away_m[: max(younger - config.gap, after_gap)], kind="stable").tolist():
        is_lost = sigma_m[k] > config.lost_m
        if len(chosen) >= (config.lost_most if is_lost else config.most):
            break
        if away_m[k] > config.near_m + 2.0 * sigma_m[k] or any(abs(k - i) < config.apart for i in chosen):
            continue
        apart_m = np.hypot(*(centres_in_map[chosen] - centres_in_map[k]).T).min(initial=np.inf)
        if not is_lost or apart_m > config.lost_apart_m:
            chosen.append(k)
    return [Candidate(k, younger, float(sigma_m[k]), float(sigma_rad[k])) for k in chosen]


def uncertainty_from(
    graph: PoseGraph, source: int, common_share: float = 0.0, compass_rad: float = np.inf
) -> tuple[Floats, Floats]:
    """(n,) variances of every node's position (m^2) and yaw (rad^2) as seen from one node.

    Summed along the surest path of edges (Dijkstra projection; Bosse et al. 2004, section 5), where an
    edge's turn displaces the source by its distance to the edge; or, between nodes whose heading a compass
    knows, by its own length. Errors that all edges have in common add up instead of averaging out: standard
    deviations are summed for that share of them.
    """
    from scipy.sparse.csgraph import dijkstra

    n = len(graph.poses)
    if n < 2:
        return np.zeros(n), np.zeros(n)
    ends, var_m2, var_rad2 = _edge_variances(graph)
    heading2 = _heading_variances(graph, compass_rad)
    xy = graph.poses[:, :2]
    lever, length = 0.5 * (xy[ends[:, 0]] + xy[ends[:, 1]]) - xy[source], xy[ends[:, 1]] - xy[ends[:, 0]]
    sway = var_rad2 * (lever * lever).sum(axis=1)
    least_known, known_sway = heading2[ends].max(axis=1), np.full(len(ends), np.inf)
    np.multiply(least_known, (length * length).sum(axis=1), out=known_sway, where=least_known < np.inf)
    cost = var_m2 + np.minimum(sway, known_sway)
    least = _least_per_pair(ends, cost, n)
    distance, before = dijkstra(
        _matrix(ends[least], cost[least], n), directed=False, indices=source, return_predecessors=True
    )
    yaw = _matrix(ends[least], var_rad2[least], n)
    outward = np.argsort(distance, kind="stable")[1:]
    outward = outward[before[outward] >= 0]
    at = before[outward]
    step_yaw = np.asarray(yaw[at, outward]).ravel() + np.asarray(yaw[outward, at]).ravel()
    sums = np.zeros((n, 3))  # yaw variance, and the standard deviations of position and yaw
    steps = np.column_stack((step_yaw, np.sqrt(distance[outward] - distance[at]), np.sqrt(step_yaw)))
    for node, earlier, step in zip(outward.tolist(), at.tolist(), steps, strict=True):
        sums[node] = sums[earlier] + step
    own = 1.0 - common_share
    by_turns = own * sums[:, 0] + common_share * sums[:, 2] ** 2
    return own * distance + common_share * sums[:, 1] ** 2, np.minimum(by_turns, heading2 + heading2[source])


def _edge_variances(graph: PoseGraph) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Ends (m, 2), position and yaw variance of every edge that has any weight left and tells a position."""
    tells = (graph.information[:, 0, 0] > 0.0) & (graph.information[:, 2, 2] > 0.0)
    alive = tells & (graph.weights() > LEAST_WEIGHT)
    covariance: Floats = np.linalg.inv(graph.information[alive] + SURELY_REGULAR).astype(np.float64)
    return graph.ends[alive], covariance[:, 0, 0] + covariance[:, 1, 1], covariance[:, 2, 2]


def _heading_variances(graph: PoseGraph, compass_rad: float) -> Floats:
    """(n,) rad^2 of the nodes whose heading an edge tells that tells nothing else; inf of all others."""
    tells = (graph.information[:, 0, 0] == 0.0) & (graph.information[:, 2, 2] > 0.0)
    variances = np.full(len(graph.poses), np.inf)
    variances[graph.ends[tells & (graph.weights() > LEAST_WEIGHT)].ravel()] = compass_rad**2
    return variances


def _least_per_pair(ends: NDArray[np.int64], cost: Floats, n: int) -> NDArray[np.int64]:
    """Indices of the edges of least cost among those between the same two nodes."""
    order = np.lexsort((cost, ends[:, 1], ends[:, 0]))
    key = ends[order, 0] * n + ends[order, 1]
    return order[np.concatenate(([True], key[1:] != key[:-1]))]


def _matrix(ends: NDArray[np.int64], values: Floats, n: int):
    from scipy.sparse import csr_matrix

    return csr_matrix((values, (ends[:, 0], ends[:, 1])), shape=(n, n))
