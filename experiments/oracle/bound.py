"""How short no tour can be.

Two bounds, and the larger of them counts. Both hold on the floor's lattices of nodes and samples.

- *Far*: on a way of d metres a robot comes nowhere farther than d from the start. So d is at least the
  distance within which all nodes together see enough.
- *Witnesses*: more samples than may be missed, near each other, cannot all be missed; so a tour comes to a
  node that sees one of them. Several such groups whose nodes lie apart must all be come to, and between
  coming first to one and coming first to the next the way is at least as long as the regions are apart. The
  shortest path through all regions is bounded by Held and Karp's 1-trees (The traveling-salesman problem
  and minimum spanning trees, 1970).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from experiments.oracle.floor import Floor, Ints, Rows

OCTILE = math.cos(math.pi / 8.0)
"""A way of straight and diagonal steps is at most so many times shorter when it may go anywhere."""
LEAST_APART_M = 0.5
"""Regions nearer to each other than this are not told apart."""
MOST_REGIONS = 60
ASCENT_STEPS = 150


def lower_bound_m(floor: Floor, share: float) -> float:
    """No tour over the floor's nodes that sees this share of its samples is shorter.

    0 where all nodes together see less: nothing is known then of a robot that does not keep to them.
    """
    may_miss = math.floor((1.0 - share) * floor.weight.sum())
    far_m = far_bound_m(floor, may_miss)
    return max(far_m, witness_bound_m(floor, may_miss)) if math.isfinite(far_m) else 0.0


def far_bound_m(floor: Floor, may_miss: int) -> float:
    """The least distance within which all nodes together see enough."""
    away_m = distances_m(floor, floor.place_nodes[floor.start_place, None])
    at_most_m = first_m(floor.sees, away_m[floor.place_nodes], len(floor.samples))
    order = np.argsort(-at_most_m, kind="stable")
    number = 1 + int(np.searchsorted(np.cumsum(floor.weight[order]), may_miss, side="right"))
    while True:  # only of the samples that places see late, some nodes may decide
        late = order[:number]
        exactly_m = first_m(looks(floor, late), away_m, len(late))
        latest = np.argsort(-exactly_m, kind="stable")
        missed = np.cumsum(floor.weight[late[latest]])
        bound_m = float(exactly_m[latest[np.searchsorted(missed, may_miss, side="right")]])
        if number >= len(order) or at_most_m[order[number]] <= bound_m:
            return bound_m
        number *= 2


def witness_bound_m(floor: Floor, may_miss: int) -> float:
    """The shortest path from the start through regions that must all be come to, or less."""
    regions = [floor.place_nodes[floor.start_place, None]]
    away_m = [distances_m(floor, regions[0])]

    def is_apart(nodes: Ints) -> bool:
        return all(row[nodes].min() > LEAST_APART_M for row in away_m)

    for group, places in witnesses(floor, may_miss):
        if len(regions) < MOST_REGIONS and is_apart(floor.place_nodes[places]):
            region = np.flatnonzero(np.diff(looks(floor, group).starts)).astype(np.int32)
            if is_apart(region):
                regions.append(region)
                away_m.append(distances_m(floor, region))
    between_m = np.array([[row[region].min() for region in regions] for row in away_m])
    return path_bound(np.minimum(between_m, between_m.T))


def witnesses(floor: Floor, may_miss: int) -> Iterator[tuple[NDArray[np.int64], Ints]]:
    """Groups of samples that cannot all be missed, each with the places that see any; fewest places first."""
    seen_by = np.diff(floor.seen_from.starts)
    taken = np.zeros(len(floor.samples), bool)
    found: list[tuple[NDArray[np.int64], Ints]] = []
    for sample in np.argsort(seen_by, kind="stable"):
        if taken[sample] or not seen_by[sample]:
            continue
        away = np.hypot(*(floor.samples - floor.samples[sample]).T) + 1e9 * (taken | (seen_by == 0))
        group = np.argsort(away, kind="stable")
        group = group[: 1 + np.searchsorted(np.cumsum(floor.weight[group]), may_miss, side="right")]
        if away[group[-1]] >= 1e9:
            break
        taken[group] = True
        found.append((group, np.unique(np.concatenate([floor.seen_from[s] for s in group]))))
    yield from sorted(found, key=lambda witness: len(witness[1]))


def looks(floor: Floor, samples: NDArray[np.int64]) -> Rows:
    """From every node at some samples: places alone see less than a robot does on its way between them."""
    from experiments.oracle import floor_kernels as kernels

    return Rows(*kernels.looks(floor.free, floor.samples[samples], floor.nodes, floor.reach))


def first_m(sees: Rows, away_m: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    """(samples,) how far away the nearest of those is that see each; inf where none does."""
    first = np.full(samples, math.inf)
    np.minimum.at(first, sees.columns, np.repeat(away_m, np.diff(sees.starts)))
    return first


def distances_m(floor: Floor, sources: Ints) -> NDArray[np.float64]:
    """(n,) metres from the nearest of some nodes to every node, at least: no way is shorter.

    A robot is at a node as soon as it comes into its cell, at either end.
    """
    from experiments.oracle import floor_kernels as kernels

    cost, link = np.empty(len(floor.nodes), np.int32), np.empty(len(floor.nodes), np.int8)
    kernels.flood(floor.around, sources, cost, link)
    cell_m = floor.resolution_m * floor.stride
    return np.maximum(cost * (OCTILE * cell_m / kernels.STRAIGHT) - math.sqrt(2.0) * cell_m, 0.0)


def path_bound(between_m: NDArray[np.float64]) -> float:
    """At most the length of the shortest path from node 0 through all nodes (k, k), in any order.

    A path is a tree whose inner nodes have two edges. Weights of nodes, which change all paths' lengths
    alike, are raised where the lightest tree has more.
    """
    k = len(between_m)
    if k < 2:
        return 0.0
    weight, best, step = np.zeros(k), 0.0, between_m.max() / k
    for _ in range(ASCENT_STEPS):
        total, degree = spanning_tree(between_m + weight[:, None] + weight[None, :])
        end = 1 + int(np.argmin(weight[1:]))  # nobody knows where the path ends: here it would cost most
        inner = 2.0 * weight.sum() - weight[0] - weight[end]
        best = max(best, total - inner)
        target = np.full(k, 2.0)
        target[0] = target[end] = 1.0
        weight += step * (degree - target)
        step *= 0.97
    return float(best)


def spanning_tree(cost: NDArray[np.float64]) -> tuple[float, NDArray[np.int64]]:
    """Weight of the lightest tree over all nodes and how many of its edges meet at each (Prim 1957)."""
    k = len(cost)
    degree, total = np.zeros(k, np.int64), 0.0
    nearest, parent = cost[0].copy(), np.zeros(k, np.int64)
    nearest[0] = math.inf
    out = np.ones(k, bool)
    out[0] = False
    for _ in range(k - 1):
        node = int(np.argmin(np.where(out, nearest, math.inf)))
        total += nearest[node]
        degree[node] += 1
        degree[parent[node]] += 1
        out[node] = False
        closer = out & (cost[node] < nearest)
        nearest[closer], parent[closer] = cost[node][closer], node
    return float(total), degree
