"""A tour through all frontiers: what lies ahead decides what comes first.

After Cao et al., TARE: a hierarchical framework for efficiently exploring complex 3D environments, RSS
2021, who order what is left to see by a travelling salesman's tour. The tour is for the order alone: the
map will have grown before the second stop. So its end is charged with most of the way back to where the
robot is: each frontier leads on to others, and what is left behind now is come back for from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.coarse_map import Blocks, CoarseMap
from occmap.lookouts import Lookout, Sight, lookouts
from occmap.search import SearchMemory
from occmap.ways import TravelCosts

if TYPE_CHECKING:
    from occmap.terrain import Terrain

MOST_STOPS = 12
"""A tour has no more stops: their best order is then found in a millisecond."""
WIDER = 1.5
"""Far stops are drawn together by this factor until there are no more than that."""


@dataclass(frozen=True)
class TourConfig:
    """How a tour weighs what is near against what is far (strategy tour)."""

    stop_m: float = 1.0
    """Lookouts whose ways apart are no longer than this are one stop,"""
    stop_share: float = 0.2
    """or than this share of the way to them: what is far needs no more detail."""
    hysteresis_m: float = 1.0
    """Another first stop must make the tour shorter by this much before the one being driven to is left,"""
    hysteresis_share: float = 0.25
    """or by this share of the way to it: what opens and closes far away turns a whole tour round."""
    return_share: float = 0.8
    """This share of the way from a tour's end back to the robot counts. At 0 a tour leaves behind whatever it
    can end with; at 1 it does not matter which way round it goes."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must not be negative, got {value}")
        for name in ("stop_m", "stop_share"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} must be positive, got 0.0")


@dataclass(frozen=True)
class Stop:
    """Frontiers that are looked at together."""

    members: tuple[int, ...]
    """Indices of the frontiers: those seen from the lookout first, the largest first."""
    cost_m: float
    """The way from the robot to the farthest of its lookouts, estimated."""
    lookout: tuple[int, int] | None
    """The cell (ix, iy) from which the first of the members are seen; None if there is no room for one."""
    in_sight: int
    """How many of `members`, the first ones, the lookout sees."""


class Tour:
    """Orders frontiers. Remembers its search arrays, and what ways cost."""

    def __init__(self, config: TourConfig) -> None:
        from occmap import tour_kernels  # compiled on first use, not on import

        self.config = config
        self._memory = SearchMemory()
        self._ways = TravelCosts()
        self._kernels = tour_kernels

    def stops(
        self,
        sights: Sequence[Sight],
        terrain: Terrain,
        start_cell: tuple[int, int],
        pursued: int | None = None,
    ) -> list[Stop]:
        """The stops of the best tour from a cell, in their order; without the frontiers it does not get to.

        pursued: the index of the frontier that the robot is on its way to.
        """
        coarse = CoarseMap(terrain, self._memory)
        start = coarse.block_near(start_cell)
        if start is None or not sights:
            return []
        costs_m = coarse.costs_from_m(start)
        found = lookouts(coarse, sights, costs_m)
        if not found:
            return []
        costs_m = costs_m.ravel()
        found.sort(key=lambda lookout: float(costs_m[lookout.block]))
        blocks = np.array([lookout.block for lookout in found], np.int64)
        groups, between_m = self._grouped(coarse, blocks, costs_m[blocks])
        kept = next((n for n, g in enumerate(groups) if any(pursued in found[k].members for k in g)), None)
        order = self._order(costs_m[blocks[[group[0] for group in groups]]], between_m, kept)
        return [
            self._stop([found[k] for k in groups[n]], coarse, float(costs_m[blocks[groups[n]]].max()))
            for n in order
        ]

    def _stop(self, group: list[Lookout], coarse: CoarseMap, cost_m: float) -> Stop:
        """The stop made of lookouts, the nearest first."""
        first = group[0]
        lookout = coarse.cell_in(first.block) if first.is_exact else None
        members = tuple(k for each in group for k in each.members)
        return Stop(members, cost_m, lookout, len(first.members))

    def _grouped(
        self, coarse: CoarseMap, blocks: Blocks, from_start_m: NDArray[np.float64]
    ) -> tuple[list[list[int]], NDArray[np.float64]]:
        """Groups of places given the nearest first, and the costs (n, n) between their first members."""
        ways, share = self._ways, self.config.stop_share
        ways.open(coarse, blocks)
        places_m = coarse.places_m(blocks)
        while True:
            reach_m = np.maximum(self.config.stop_m, share * from_start_m)
            if _drawn_together(places_m, reach_m, None) is not None:  # else searching for ways is in vain
                groups = _drawn_together(places_m, reach_m, ways)
                if groups is not None:
                    return groups, ways.between_m([group[0] for group in groups])
            share *= WIDER

    def _order(
        self,
        from_start_m: NDArray[np.float64],
        between_m: NDArray[np.float64],
        kept: int | None,
    ) -> list[int]:
        """The stops as on the best tour, or as on one hardly longer that begins with the one to keep."""
        after = self._kernels.best_after(between_m, self.config.return_share * from_start_m)
        left = len(after) - 1  # a set of stops, as bits
        totals_m = from_start_m + after[left]
        here = int(np.argmin(totals_m))
        if kept is not None:
            c = self.config
            slack_m = max(c.hysteresis_m, c.hysteresis_share * float(from_start_m[kept]))
            here = kept if totals_m[kept] < totals_m[here] + slack_m else here
        order = [here]
        while left := left & ~(1 << here):
            onward_m = between_m[here] + after[left]
            here = int(np.argmin(onward_m))  # inf for what is not left
            order.append(here)
        return order


def _drawn_together(
    places_m: NDArray[np.float64], reach_m: NDArray[np.float64], ways: TravelCosts | None
) -> list[list[int]] | None:
    """Groups of places, each in reach of its first member; by the crow's distance where no ways are given.

    None if they are more than MOST_STOPS.
    """
    groups: list[list[int]] = []
    left = np.ones(len(places_m), bool)
    while left.any():
        if len(groups) == MOST_STOPS:
            return None
        leader = int(np.argmax(left))
        away_m = np.hypot(*(places_m - places_m[leader]).T)
        members = np.flatnonzero(left & (away_m <= reach_m[leader]))
        if ways is not None:
            members = members[ways.from_one_m(leader, members.tolist()) <= reach_m[leader]]
        group = np.union1d(leader, members)
        groups.append(group.tolist())
        left[group] = False
    return groups
