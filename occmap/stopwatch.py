"""Wall time by stage."""

from __future__ import annotations

import time
from array import array
from collections import defaultdict
from collections.abc import Mapping


class Lap:
    """One lap, from entering to leaving. A class: a generator would cost more than what it often times."""

    __slots__ = ("_begun_s", "_laps_s")

    def __init__(self, laps_s: array[float]) -> None:
        self._laps_s = laps_s

    def __enter__(self) -> None:
        self._begun_s = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._laps_s.append(time.perf_counter() - self._begun_s)


class Stopwatch:
    """Adds up wall seconds under named stages and keeps the length of each lap."""

    def __init__(self) -> None:
        self.laps_s: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))

    def lap(self, stage: str) -> Lap:
        """Time the enclosed block as one lap of a stage, also when it raises."""
        return Lap(self.laps_s[stage])

    def add(self, seconds_by_stage: Mapping[str, float]) -> None:
        """Take in laps that somebody else timed."""
        for stage, seconds in seconds_by_stage.items():
            self.laps_s[stage].append(seconds)

    def total_s(self, stage: str) -> float:
        """Seconds of all laps of a stage together; 0 if it never ran."""
        return sum(self.laps_s.get(stage, ()))

    def totals_s(self) -> dict[str, float]:
        """Seconds of all laps together, stage by stage."""
        return {stage: sum(laps) for stage, laps in self.laps_s.items()}
