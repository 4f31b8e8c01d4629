"""Ways between places: how long, and what is seen along them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from experiments.oracle.floor import Floor, Ints
from occmap.geometry import Points


@dataclass(frozen=True)
class Leg:
    """The way from one place to another, pulled tight."""

    corners: Ints  # (k, 2) cells, both ends included
    length_m: float
    places: Ints  # (m,) the places it passes, without repeats


class Ways:
    """Finds each way once and remembers it."""

    def __init__(self, floor: Floor) -> None:
        from experiments.oracle import floor_kernels

        self.floor = floor
        self._kernels = floor_kernels
        self._links: dict[int, NDArray[np.int8]] = {}
        self._distance_m: dict[int, NDArray[np.float32]] = {}
        self._legs: dict[tuple[int, int], Leg] = {}

    def distance_m(self, place: int) -> NDArray[np.float32]:
        """(p,) metres to every place along straight and diagonal steps: up to 8 % too long."""
        if place not in self._distance_m:
            floor, kernels = self.floor, self._kernels
            cost, link = np.empty(len(floor.nodes), np.int32), np.empty(len(floor.nodes), np.int8)
            kernels.flood(floor.around, floor.place_nodes[place, None], cost, link)
            step_m = floor.resolution_m * floor.stride / kernels.STRAIGHT
            self._distance_m[place] = (cost[floor.place_nodes] * step_m).astype(np.float32)
            self._links[place] = link
        return self._distance_m[place]

    def leg(self, a: int, b: int) -> Leg:
        """The way between two places; a leg and its reverse are the same."""
        a, b = min(a, b), max(a, b)
        if (a, b) not in self._legs:
            self._legs[a, b] = self._found(a, b)
        return self._legs[a, b]

    def _found(self, a: int, b: int) -> Leg:
        floor = self.floor
        source, target = (b, a) if b in self._links and a not in self._links else (a, b)
        self.distance_m(source)
        nodes = self._kernels.walk(floor.around, self._links[source], floor.place_nodes[target])
        corners = self._kernels.taut(floor.stands, floor.nodes[nodes])
        if source == a:
            corners = corners[::-1]
        passed = floor.nearest_place[tuple(cells_along(corners)[:, ::-1].T)]
        return Leg(corners, length_m(corners, floor.resolution_m), np.unique(passed))


def cells_along(corners: Ints) -> Ints:
    """(n, 2) cells along straight lines between corners, about one a cell of the way."""
    pieces = [corners[:1]]
    for one, other in pairwise(corners):
        steps = int(np.abs(other - one).max())
        share = np.arange(1, steps + 1)[:, None] / max(steps, 1)
        pieces.append(np.floor(one + share * (other - one) + 0.5).astype(np.int32))
    return np.concatenate(pieces)


def length_m(corners: Ints | Points, resolution_m: float) -> float:
    """Of straight lines between corners (k, 2) given in cells."""
    return float(np.hypot(*np.diff(corners, axis=0).T).sum()) * resolution_m
