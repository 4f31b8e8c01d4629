"""A line on the terminal that says how far a replay has come."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from tqdm import tqdm

from experiments.logs.log import RecordedLog
from experiments.replaying.runner import ReplayStep
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid


class ReplayProgress:
    """Shows scans done and scans a second."""

    def __init__(self, log: RecordedLog) -> None:
        self._scans = len(log.observations)
        self._bar: tqdm | None = None

    def record(self, step: ReplayStep) -> None:
        if self._bar is None:  # the clock starts with the first scan
            self._bar = tqdm(total=self._scans, unit=" scans", file=sys.stderr, mininterval=0.25)
        self._bar.update()

    def finish(self, poses: Sequence[Pose2], grid: OccupancyGrid) -> None:
        """The bar has nothing to add."""

    def close(self) -> None:
        """Leave the last state on the terminal."""
        if self._bar is not None:
            self._bar.close()
