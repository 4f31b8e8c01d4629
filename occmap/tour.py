"""A tour through all frontiers: what lies ahead decides what comes first.

After Cao et al., TARE: a hierarchical framework for efficiently exploring complex 3D environments, RSS
2021, who order what is left to see by a travelling salesman's tour; here with an open end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.coarse_map import CoarseMap
from occmap.frontiers import Frontier
from occmap.search import SearchMemory

if TYPE_CHECKING:
    from occmap.terrain import Terrain

MOST_STOPS = 12
"""A tour has no more stops: their best order is then found in a millisecond."""
WIDER = 1.5
"""Stops are drawn together by this factor until there are no more than that."""
GAIN_RAYS = 48


@dataclass(frozen=True)
class TourConfig:
    """How a tour weighs what is near against what is far (strategy tour)."""

    stop_m: float = 3.0
    """Frontiers whose ways apart are no longer than this are one stop,"""
    stop_share: float = 0.2
    """or than this share of the way to them: what is far needs no more detail."""
    hysteresis_m: float = 1.0
    """Another first stop must make the tour shorter by this much before the one being driven to is left."""
    open_end_m: float = 15.0
    """So much longer a tour may be that ends where much is unknown: exploring goes on from there. What is
    left behind would have to be come back for from ever farther away."""
    much_m2: float = 20.0
    """Seeing so much from one place is much."""
    look_m: float = 4.0
    """How far an expected look reaches."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must not be negative, got {value}")
        for name in ("stop_m", "much_m2", "look_m"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} must be positive, got 0.0")


@dataclass(frozen=True)
class Stop:
    """Frontiers that are looked at together."""

    members: tuple[int, ...]
    """Indices of the frontiers, the nearest to the robot first."""
    cost_m: float
    """The way from the robot to the farthest of them, estimated."""


class Tour:
    """Orders frontiers. Remembers only its search arrays."""

    def __init__(self, config: TourConfig) -> None:
        from occmap import goals_kernels, tour_kernels  # compiled on first use, not on import

        self.config = config
        self._memory = SearchMemory()
        self._kernels = tour_kernels
        self._sight = goals_kernels

    def stops(
        self,
        frontiers: Sequence[Frontier],
        terrain: Terrain,
        start_cell: tuple[int, int],
        pursued: int | None = None,
    ) -> list[Stop]:
        """The stops of the best tour from a cell, in their order; without the frontiers it does not get to.

        pursued: the index of the frontier that the robot is on its way to.
        """
        coarse = CoarseMap(terrain, self._memory)
        start = coarse.block_near(start_cell)
        found = [coarse.block_of(frontier) for frontier in frontiers]
        indices = np.array([k for k, block in enumerate(found) if block is not None], np.int64)
        blocks = np.array([block for block in found if block is not None], np.int64)
        if start is None or not len(blocks):
            return []
        from_start_m = coarse.costs_m(start, blocks)
        in_reach = np.argsort(from_start_m, kind="stable")[: np.isfinite(from_start_m).sum()]
        if not len(in_reach):
            return []
        indices, blocks, from_start_m = indices[in_reach], blocks[in_reach], from_start_m[in_reach]
        groups, between_m = self._grouped(coarse, blocks, from_start_m)
        leaders = [group[0] for group in groups]
        at_the_end = np.array([-self._open_end_m(coarse, int(blocks[leader])) for leader in leaders])
        kept = next((k for k, group in enumerate(groups) if pursued in indices[group]), None)
        order = self._order(from_start_m[leaders], between_m, at_the_end, kept)
        return [Stop(tuple(indices[groups[k]].tolist()), float(from_start_m[groups[k]].max())) for k in order]

    def _grouped(
        self, coarse: CoarseMap, blocks: NDArray[np.int64], from_start_m: NDArray[np.float64]
    ) -> tuple[list[list[int]], NDArray[np.float64]]:
        """Groups of places given the nearest first, and the costs (n, n) between their first members."""
        c = self.config
        costs_m: dict[int, NDArray[np.float64]] = {}
        reach_m = np.maximum(c.stop_m, c.stop_share * from_start_m)
        while True:
            groups: list[list[int]] = []
            left = np.ones(len(blocks), bool)
            while left.any() and len(groups) <= MOST_STOPS:
                leader = int(np.argmax(left))
                if leader not in costs_m:
                    costs_m[leader] = coarse.costs_m(int(blocks[leader]), blocks)
                members = left & (costs_m[leader] <= reach_m[leader])
                members[leader] = True
                groups.append(np.flatnonzero(members).tolist())
                left &= ~members
            if len(groups) <= MOST_STOPS:
                leaders = [group[0] for group in groups]
                return groups, np.array([costs_m[leader][leaders] for leader in leaders])
            reach_m *= WIDER

    def _open_end_m(self, coarse: CoarseMap, block: int) -> float:
        """How many metres it is worth to end at a block."""
        c, r = self.config, coarse.fine.frame.resolution_m
        if c.open_end_m == 0.0:
            return 0.0
        reach = max(1, int(c.look_m / r))
        cells = self._sight.expected_gain_cells(coarse.fine.state, *coarse.middle_of(block), reach, GAIN_RAYS)
        return c.open_end_m * min(1.0, cells * r * r / c.much_m2)

    def _order(
        self,
        from_start_m: NDArray[np.float64],
        between_m: NDArray[np.float64],
        at_the_end: NDArray[np.float64],
        kept: int | None,
    ) -> list[int]:
        """The stops as on the best tour, or as on one hardly longer that begins with the one to keep."""
        after = self._kernels.best_after(between_m, at_the_end)
        left = len(after) - 1  # a set of stops, as bits
        totals_m = from_start_m + after[left]
        here = int(np.argmin(totals_m))
        if kept is not None and totals_m[kept] < totals_m[here] + self.config.hysteresis_m:
            here = kept
        order = [here]
        while left := left & ~(1 << here):
            onward_m = between_m[here] + after[left]
            here = int(np.argmin(onward_m))  # inf for what is not left
            order.append(here)
        return order
