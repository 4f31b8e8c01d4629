"""Which runs to look at first."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable

import numpy as np

from experiments.sweeping.groups import GOOD, Group, Naming
from experiments.sweeping.jobs import CRASHED, Row

LITTLE = 0.99
"""A run that explored less than this is worse than one that drove far."""


class Badness:
    """Orders runs from the worst to the best, against their own groups' medians."""

    def __init__(self, groups: Iterable[Group], naming: Naming) -> None:
        self._naming = naming
        self._metres = {
            (group.kind, group.series): float(np.median(metres))
            for group in groups
            if len(metres := group["metres"])
        }

    def why(self, row: Row) -> str:
        """In a few words, what is bad about a run."""
        return self._judged(row)[2]

    def rank(self, row: Row) -> tuple[int, float]:
        """The higher, the worse: what failed, and by how much."""
        return self._judged(row)[:2]

    def worst(self, rows: Iterable[Row], number: int) -> list[Row]:
        """The worst so many, the worst first."""
        return heapq.nlargest(number, rows, key=self.rank)

    def _judged(self, row: Row) -> tuple[int, float, str]:
        if row["status"] == CRASHED:
            return 5, 0.0, f"crashed: {row['error']}"
        missed = 1.0 - row["explored"]
        if row["status"] not in GOOD:
            return 4, missed, f"{row['status'].replace('_', ' ')}, {row['explored']:.2%} explored"
        if not row["honest"]:
            return 3, missed, f"not honest, {row['explored']:.2%} explored"
        if hits := row["collisions"]["events"]:
            return 2, hits, f"{hits:.0f} collision{'s' if hits > 1 else ''}"
        if row["explored"] < LITTLE:
            return 1, missed, f"{row['explored']:.2%} explored"
        usual_m = self._metres.get((self._naming.kind(row), self._naming.series(row)), math.nan)
        times = row["path_length_m"] / usual_m if usual_m > 0.0 else 0.0
        return 0, times, f"{times:.2f} times the median way, {row['explored']:.2%} explored"
