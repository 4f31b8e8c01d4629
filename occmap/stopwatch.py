"""Wall time by stage."""

from __future__ import annotations

import time
from array import array
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


class Stopwatch:
    """Adds up wall seconds under named stages and keeps the length of each lap."""

    def __init__(self) -> None:
        self.laps_s: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))

    @contextmanager
    def lap(self, stage: str) -> Iterator[None]:
        """Time the enclosed block as one lap of a stage, also when it raises."""
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.laps_s[stage].append(time.perf_counter() - begun)

    def add(self, seconds_by_stage: Mapping[str, float]) -> None:
        """Take in laps that somebody else timed."""
        for stage, seconds in seconds_by_stage.items():
            self.laps_s[stage].append(seconds)

    def total_s(self, stage: str) -> float:
        """All laps of a stage together; 0 if it never ran."""
        return sum(self.laps_s.get(stage, ()))

    def totals_s(self) -> dict[str, float]:
        """The same for every stage."""
        return {stage: sum(laps) for stage, laps in self.laps_s.items()}
