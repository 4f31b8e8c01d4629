"""A line on the terminal that says how far a run has come."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

from experiments.words import counted

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.episode import Step

ON_A_TERMINAL_S, IN_A_LOG_S = 0.25, 10.0
"""Wall time between two refreshes: a log keeps every one of them."""


class ProgressBar:
    """A recorder that shows % explored, frontiers left, simulated time and times real time."""

    def __init__(self, curve: ScoreCurve) -> None:
        from tqdm import tqdm

        self._curve = curve
        self._bar = tqdm(total=100.0, bar_format="|{bar:24}| {desc}", file=sys.stderr, mininterval=0.0)
        self._period_s = ON_A_TERMINAL_S if sys.stderr.isatty() else IN_A_LOG_S
        self._begun = self._shown = time.perf_counter()
        self._last: Step | None = None

    def record(self, step: Step) -> None:
        """Refresh now and then."""
        self._last = step
        if time.perf_counter() - self._shown >= self._period_s:
            self._show(step)

    def close(self) -> None:
        """Leave the last state on the terminal."""
        if self._last is not None:
            self._show(self._last)
        self._bar.close()

    def _show(self, step: Step) -> None:
        self._shown = time.perf_counter()
        rate = step.truth.time_s / max(self._shown - self._begun, 1e-6)
        minutes, seconds = divmod(int(step.truth.time_s), 60)
        explored = 100.0 * self._curve.latest.score.explored
        self._bar.n = explored
        self._bar.set_description_str(
            f"{explored:5.1f} % explored, {counted(len(step.decision.frontiers), 'frontier')} left, "
            f"{minutes}:{seconds:02d} min simulated, {rate:.0f} x real time"
        )
