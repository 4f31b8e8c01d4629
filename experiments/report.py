"""One page about many runs: what they came to, how they got there, and which ones to look at.

    python -m experiments.report runs/sweep
    python -m experiments.report runs/before runs/after --out runs/report

The page holds its pictures and can be sent as it is; the figures lie beside it as PNG files too.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro

from experiments.exit_status import MISTAKE


@dataclass(frozen=True)
class Report:
    """Write one HTML page about the runs of one or several sweeps, and its figures beside it.

    Exit status: 0, or 2 for a user's mistake.
    """

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders that sweeps left. Of several, each counts as a way of running of its own."""
    out: Path | None = None
    """The report's folder; by default `report` in the first sweep's. A report that is there is replaced."""
    title: str = "Exploring unknown buildings"
    """What the page is called."""
    worst: int = 10
    """So many runs are shown as pictures."""
    failures: int = 100
    """At most so many failures are listed."""

    def __post_init__(self) -> None:
        if not self.folders:
            raise ValueError("give at least one folder of a sweep")
        if self.worst < 0 or self.failures < 0:
            raise ValueError(f"worst and failures must not be negative, got {self.worst} and {self.failures}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse and write; the page's path goes to standard output."""
    asked = tyro.cli(Report, prog="python -m experiments.report", args=arguments)
    from experiments.reporting.compose import write_report

    try:
        print(write_report(asked.folders, asked.out, asked.title, asked.worst, asked.failures))
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    return 0


if __name__ == "__main__":
    sys.exit(main())
