"""The oracle's answer: a short tour that is checked to see enough, and how much shorter none can be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from experiments.oracle.bound import lower_bound_m
from experiments.oracle.floor import Floor, Ints
from experiments.oracle.search import Stops, TourSearch
from experiments.oracle.ways import Ways
from experiments.planar import travelled_m
from occmap.geometry import Points

ENOUGH = 0.995
"""Share of the explorable area that a tour must see."""
STOPS_APART_M = 1.0
"""A trail is made into a tour with stops so far apart."""


@dataclass(frozen=True)
class OracleConfig:
    """How long to look for a shorter tour."""

    rounds: int = 60
    """Of ruin and recreate from each beginning: from nothing, and from every trail."""
    more_rounds: int = 60
    """Of the same from the best of those; and again each time that the tour is found to see too little."""
    seed: int = 0
    """The same seed, the same tour."""

    def __post_init__(self) -> None:
        if self.rounds < 0 or self.more_rounds < 0:
            raise ValueError(f"rounds must not be negative, got {self.rounds} and {self.more_rounds}")


@dataclass(frozen=True)
class Oracle:
    """A tour in `world`."""

    path: Points  # (k, 2) corners, the start first
    length_m: float
    seen: float
    """Share of the explorable area in sight of it: ENOUGH, unless the lattices cannot see as much."""
    lower_bound_m: float
    """No tour that sees ENOUGH is shorter, see `experiments.oracle.bound`."""


def near_shortest_tour(
    floor: Floor, trails: Sequence[Points] = (), config: OracleConfig | None = None
) -> Oracle:
    """A tour from the start that sees ENOUGH of the floor; never longer than a trail (n, 2) that does.

    The trails, in `world`, are ways that robots have driven there.
    """
    best = _cut_short(floor, _searched(floor, trails, config or OracleConfig()))
    most_m = metres(best) if seen_along(floor, best) >= ENOUGH else math.inf
    for trail in trails:
        begun = _first_metres(trail, most_m)
        if seen_along(floor, begun) >= ENOUGH:
            best = _cut_short(floor, begun)
            most_m = metres(best)
    # No more than the tour: a trail may have been where no node is.
    bound_m = min(lower_bound_m(floor, ENOUGH), metres(best))
    return Oracle(best, metres(best), seen_along(floor, best), bound_m)


def metres(path: Points) -> float:
    """Along a path (k, 2)."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def seen_along(floor: Floor, path: Points) -> float:
    """Share of the explorable area in sight of a path (k, 2) in `world`."""
    return floor.seen_share(floor.cells_of(divided(path, floor.resolution_m)))


def _searched(floor: Floor, trails: Sequence[Points], config: OracleConfig) -> Points:
    """The search counts samples seen from places; where that was too kind, it is asked for a little more."""
    rng, ways, wanted = np.random.default_rng(config.seed), Ways(floor), ENOUGH
    beginnings = [[floor.start_place], *(_stops_along(floor, ways, trail) for trail in trails)]
    rounds, best, path = config.rounds, beginnings[0], floor.world_from(np.array([floor.start]))
    while wanted <= 1.0:
        search = TourSearch(floor, ways, wanted, rng)
        best = min((search.improved(stops, rounds) for stops in beginnings), key=search.length_m)
        best = search.improved(best, config.more_rounds)
        path = divided(floor.world_from(_corners(floor, ways, best)), floor.resolution_m)
        if (lacking := ENOUGH - seen_along(floor, path)) <= 0.0:
            break
        wanted, beginnings, rounds = wanted + lacking + 0.0002, [best], 0
    return path


def _corners(floor: Floor, ways: Ways, stops: Stops) -> Ints:
    """(k, 2) cells of the whole tour."""
    out = [np.array([floor.start], np.int32)]
    for a, b in pairwise(stops):
        corners = ways.leg(a, b).corners
        out.append(corners[1:] if a < b else corners[::-1][1:])
    return np.concatenate(out)


def _stops_along(floor: Floor, ways: Ways, trail: Points) -> Stops:
    cells = floor.cells_of(trail)
    stops = [floor.start_place]
    for place in floor.nearest_place[cells[:, 1], cells[:, 0]].tolist():
        if ways.distance_m(stops[-1])[place] >= STOPS_APART_M:
            stops.append(place)
    return list(dict.fromkeys(stops))  # what is passed twice is seen at once


def _first_metres(path: Points, length_m: float) -> Points:
    """What of a path lies within so many metres of its beginning."""
    return path[travelled_m(path) <= length_m]


def _cut_short(floor: Floor, path: Points) -> Points:
    """The path as far as is needed to see ENOUGH."""
    fine = divided(path, floor.resolution_m)
    cells = floor.cells_of(fine)
    enough, step = len(fine), 8
    while step and enough > 1:
        fewer = max(enough - step, 1)
        if floor.seen_share(cells[:fewer]) >= ENOUGH:
            enough, step = fewer, 2 * step
        else:
            step = step // 4
    return fine[:enough]


def divided(path: Points, step_m: float) -> Points:
    """The same path with a point at least every step_m."""
    pieces = [path[:1]]
    for one, other in pairwise(path):
        n = max(1, int(np.ceil(np.hypot(*(other - one)) / step_m)))
        pieces.append(one + np.arange(1, n + 1)[:, None] / n * (other - one))
    return np.concatenate(pieces)
