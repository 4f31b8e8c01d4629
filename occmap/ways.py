"""What ways between places cost, remembered from one tour to the next: most of a map stays as it was."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from occmap.coarse_map import Blocks, CoarseMap

TRUSTED_TOURS = 20
"""After so many tours all is measured anew: a way that has opened since may be shorter."""


class TravelCosts:
    """Remembers costs between blocks of a coarse map, in metres, dearer near walls; inf where no way leads.

    From the robot's own block they are not: it is another all the time.
    """

    def __init__(self) -> None:
        self._costs_m: dict[tuple[int, int], float] = {}
        self._tours = 0
        self._extent: object = None
        """Of the coarse map that the blocks are indices into."""

    def open(self, coarse: CoarseMap, blocks: Blocks) -> None:
        """Begin a tour through these blocks (n,), each told by its place in them from here on."""
        extent = coarse.terrain.frame, coarse.terrain.shape
        self._tours += 1
        if extent != self._extent or self._tours > TRUSTED_TOURS:
            self._costs_m.clear()
            self._extent, self._tours = extent, 0
        self._coarse, self._blocks = coarse, blocks
        self._names: list[int] = blocks.tolist()

    def from_one_m(self, one: int, others: Sequence[int]) -> NDArray[np.float64]:
        """(n,) metres from one of the tour's blocks to others, all told by their place in the list."""
        if not all(self._is_known(one, other) for other in others):
            self._flood(one)
        return self._read(one, others)

    def between_m(self, some: Sequence[int]) -> NDArray[np.float64]:
        """(n, n) metres from each of some of the tour's blocks to each other: as few floods as it takes."""
        while True:
            missing = [sum(not self._is_known(a, b) for b in some) for a in some]
            if not any(missing):
                return np.array([self._read(one, some) for one in some])
            self._flood(some[int(np.argmax(missing))])

    def _is_known(self, one: int, other: int) -> bool:
        return (self._names[one], self._names[other]) in self._costs_m

    def _read(self, one: int, others: Sequence[int]) -> NDArray[np.float64]:
        return np.array([self._costs_m[self._names[one], self._names[other]] for other in others])

    def _flood(self, one: int) -> None:
        """Measure ways from a block to all of the tour; back, they cost as much, but half a block an end."""
        start = self._names[one]
        costs_m = self._coarse.costs_m(start, self._blocks).tolist()
        for other, cost_m in zip(self._names, costs_m, strict=True):
            self._costs_m[start, other] = self._costs_m[other, start] = cost_m
