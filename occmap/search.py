"""One search over a terrain: what it is asked, and the arrays it works in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.grid import Cells, flat_inside
from occmap.lazy_arrays import lazy_zeros
from occmap.terrain import Terrain

NO_LIMIT = 1 << 62
HEADING_BITS = 7
"""Buckets of an A*: the eighth of a step wide."""
FIRST_ITEMS = 1 << 17
"""Queue entries at first; a search that runs short of them begins anew with twice as many."""
ROOM = 2
"""Arrays are made for so many times the cells of a map, which may grow: what is not used costs nothing."""


@dataclass(frozen=True, eq=False)
class SearchRequest:
    """Where a search heads and when it may end."""

    box: tuple[int, int, int, int]
    """Cells (ix0, iy0, ix1, iy1), both ends within, that an A* heads for; the whole map for a flood."""
    bucket_bits: int
    """Buckets are 2**bits of cost wide."""
    targets: NDArray[np.int64]  # (n,) flat cells
    want: int
    """The search may end when so many targets are settled."""
    limit: int
    """It ends when it has passed this cost."""

    @staticmethod
    def flood(terrain: Terrain, targets: Cells | None, want: int | None, within_m: float) -> SearchRequest:
        """A request to flood all that costs at most within_m, or until `want` of the targets (n, 2), by
        default all of them, are settled. Buckets as wide as the cheapest step expand every cell once.
        """
        from occmap.planner_kernels import STRAIGHT, STRAIGHT_BITS

        flat = np.empty(0, np.int64) if targets is None else flat_inside(targets, terrain.shape)
        if want is None:
            want = len(flat) if targets is not None else NO_LIMIT
        limit = NO_LIMIT if math.isinf(within_m) else int(within_m / terrain.frame.resolution_m * STRAIGHT)
        return SearchRequest(terrain.everywhere, STRAIGHT_BITS, flat, want, limit)

    @staticmethod
    def towards(terrain: Terrain, goals: Cells) -> SearchRequest:
        """A request for A* to the cheapest of some goals (n, 2): finer buckets expand fewer cells twice."""
        low, high = goals.min(axis=0), goals.max(axis=0)
        box = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        return SearchRequest(box, HEADING_BITS, flat_inside(goals, terrain.shape), 1, NO_LIMIT)


class SearchMemory:
    """Arrays that searches share, so that each costs what it touches and not the whole map."""

    def __init__(self) -> None:
        self.cost: NDArray[np.int32] = np.empty(0, np.int32)
        self.link: NDArray[np.uint8] = np.empty(0, np.uint8)
        self.touched: NDArray[np.int32] = np.empty(0, np.int32)
        self.items: NDArray[np.int32] = np.empty((FIRST_ITEMS, 2), np.int32)
        self.search_number = 0
        self._rooms = self.cost, self.link, self.touched  # what these are cut from
        self._n_filled = 0  # so many entries of cost's room are UNREACHED, or listed in touched
        self._heads: NDArray[np.int32] = np.empty(0, np.int32)
        self._at = np.array([0, -1, 0, 0])  # how far the search is, see planner_kernels.AT_BUCKET

    @property
    def n_touched(self) -> int:
        """Cells that the last search has come to."""
        from occmap.planner_kernels import N_TOUCHED

        return int(self._at[N_TOUCHED])

    def search(self, terrain: Terrain, start: int, prices: NDArray[np.int32], request: SearchRequest) -> int:
        """Fill `cost` and `link` from a flat start cell; the cost below which they are exact.

        What the last search found is void from here on.
        """
        from occmap import planner_kernels as kernels

        self._make_room(terrain.state.size)
        ring = _ring_size(int(prices.max()), request.bucket_bits)
        if len(self._heads) != ring + 2:
            self._heads = np.empty(ring + 2, np.int32)
        self.search_number += 1
        while True:
            self._at[kernels.N_WAITING] = kernels.NOT_BEGUN
            exact_below = self._run(terrain, start, prices, request)
            if exact_below != kernels.OUT_OF_MEMORY:
                return exact_below
            self.items = np.empty((2 * len(self.items), 2), np.int32)

    def _make_room(self, n_cells: int) -> None:
        """Cut the arrays to a map's size. Where it has grown, only what is new has to be filled."""
        from occmap.planner_kernels import N_TOUCHED, UNREACHED

        if n_cells == self.cost.size:
            return
        is_short = n_cells > self._rooms[0].size
        if is_short:
            self._rooms = tuple(lazy_zeros((1, ROOM * n_cells), t)[0] for t in (np.int32, np.uint8, np.int32))
        if is_short or n_cells < self.cost.size:
            self._n_filled = self._at[N_TOUCHED] = 0
        cost, link, touched = self._rooms
        cost[self._n_filled : n_cells] = UNREACHED
        self._n_filled = n_cells
        self.cost, self.link, self.touched = cost[:n_cells], link[:n_cells], touched[:n_cells]

    def widen(self, terrain: Terrain, start: int, prices: NDArray[np.int32], request: SearchRequest) -> int:
        """Go on with the last search up to the request's limit, over the same map and for no targets.

        Costs what is new, and finds what a search from the beginning would.
        """
        from occmap.planner_kernels import OUT_OF_MEMORY

        self.search_number += 1
        exact_below = self._run(terrain, start, prices, request)
        if exact_below != OUT_OF_MEMORY:
            return exact_below
        return self.search(terrain, start, prices, request)

    def _run(self, terrain: Terrain, start: int, prices: NDArray[np.int32], request: SearchRequest) -> int:
        from occmap.planner_kernels import DIRECTION, OPEN, TARGET, search

        self.link[request.targets] = TARGET
        with terrain.closures():
            exact_below = search(
                terrain.state.ravel(), terrain.clearance_m.ravel(), terrain.shape[1], prices, start,
                request.box, request.want, request.limit, request.bucket_bits,
                self._at, self.cost, self.link, self.touched, self._heads, self.items,
            )  # fmt: skip
        self.link[request.targets] &= DIRECTION | OPEN
        return exact_below


def _ring_size(dearest: int, bucket_bits: int) -> int:
    """Number of buckets, a power of two: the dearest diagonal step away from the goal must not come round."""
    from occmap.planner_kernels import DIAGONAL, STRAIGHT

    widest = dearest * DIAGONAL // STRAIGHT + DIAGONAL
    return 1 << ((widest >> bucket_bits) + 2).bit_length()
