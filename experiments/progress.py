"""A line on the terminal that says how far a run has come."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.episode import Step

REFRESH_S = 0.25
"""Wall time between two refreshes."""


class ProgressBar:
    """A recorder that shows % explored, frontiers left, simulated time and times real time."""

    def __init__(self, curve: ScoreCurve) -> None:
        from tqdm import tqdm

        self._curve = curve
        self._bar = tqdm(
            total=100.0,
            bar_format="explored {n:5.1f} % |{bar}| {postfix}",
            file=sys.stderr,
            mininterval=0.0,
            leave=True,
        )
        self._begun = self._shown = time.perf_counter()

    def record(self, step: Step) -> None:
        """Refresh a few times a second."""
        if time.perf_counter() - self._shown >= REFRESH_S:
            self._show(step)
        self._last = step

    def close(self) -> None:
        """Leave the last state on the terminal."""
        if self._curve.samples:
            self._show(self._last)
        self._bar.close()

    def _show(self, step: Step) -> None:
        self._shown = time.perf_counter()
        rate = step.truth.time_s / max(self._shown - self._begun, 1e-6)
        minutes, seconds = divmod(step.truth.time_s, 60.0)
        self._bar.n = 100.0 * self._curve.latest.score.explored
        self._bar.set_postfix_str(
            f"{len(step.decision.frontiers)} frontiers left, "
            f"{minutes:.0f}:{seconds:04.1f} min simulated, {rate:.0f} x real time"
        )
