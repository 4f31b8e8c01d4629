"""A line on the terminal that says how far a replay has come."""

from __future__ import annotations

import sys

from experiments.logs.log import RecordedLog
from experiments.replaying import ReplayStep
from experiments.tum_file import Trajectory
from occmap.grid import OccupancyGrid


class ReplayProgress:
    """Shows scans done and scans a second."""

    def __init__(self, log: RecordedLog) -> None:
        from tqdm import tqdm

        self._bar = tqdm(total=len(log.observations), unit=" scans", file=sys.stderr, mininterval=0.25)

    def record(self, step: ReplayStep) -> None:
        self._bar.update()

    def finish(self, robot: Trajectory, grid: OccupancyGrid) -> None:
        """The bar has nothing to add."""

    def close(self) -> None:
        """Leave the last state on the terminal."""
        self._bar.close()
