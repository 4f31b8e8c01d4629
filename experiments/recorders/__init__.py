"""What people look at. A recorder consumes the Steps of an episode and never influences it.

Recorders hold their file open only between construction and `close`; whoever makes one closes it
(`contextlib.closing` works), also when the run ends early. A recorder that shows scores is given
the run's `ScoreCurve`, which sees every step first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from experiments.episode import Step


class Recorder(Protocol):
    """Watches one episode."""

    def record(self, step: Step) -> None:
        """Take in one step. The grid is a live view: copy what must outlive the call."""
        ...

    def close(self) -> None:
        """Finish the file. Called once, after the last step, also when the run was cut short."""
        ...
