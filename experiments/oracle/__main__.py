"""How long an explorer's way was beside that of an oracle who knows the building: docs/oracle.md.

python -m experiments.oracle runs/office-0 runs/office-0-2
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.exit_status import MISTAKE

if TYPE_CHECKING:
    from experiments.oracle.run_files import FinishedRun

ORACLE, PICTURE = "oracle.json", "oracle.png"
"""The figures and the tour in `world`, and a picture of both ways."""


@dataclass(frozen=True)
class OracleCommand:
    """A near-shortest tour that sees 99.5 % of the building, for runs that have ended.

    Runs that started from the same pose in the same building share one tour, never longer than any of theirs.
    Leaves oracle.json and oracle.png in each run's folder. Exit status: 0 done, 2 a mistake.
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Folders of runs that have ended."""
    rounds: int = 60
    """How long to look for a shorter tour: rounds of ruin and recreate from every beginning."""
    seed: int = 0
    """The same seed, the same tour."""

    def __post_init__(self) -> None:
        if not self.runs:
            raise ValueError("name at least one folder of a run")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line a run."""
    command = tyro.cli(OracleCommand, prog="python -m experiments.oracle", args=arguments)
    try:
        tasks = grouped(command.runs)
        print(f"{'run':<32}{'driven':>10}{'oracle':>10}{'at least':>10}{'ratio':>8}")
        for runs in tasks:
            for line in answers(runs, command):
                print(line, flush=True)
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    return 0


def grouped(folders: Sequence[Path]) -> list[list[FinishedRun]]:
    """Runs of one task together, in the order in which the tasks were first named."""
    from experiments.oracle.run_files import read_run

    tasks: dict[object, list[FinishedRun]] = {}
    for folder in folders:
        run = read_run(folder)
        tasks.setdefault(run.task, []).append(run)
    return list(tasks.values())


def answers(runs: list[FinishedRun], command: OracleCommand) -> Iterator[str]:
    """One tour for all of these runs; writes it into each one's folder."""
    from experiments.oracle.figures import compared
    from experiments.oracle.picture import draw_ways
    from experiments.oracle.tour import OracleConfig, metres, near_shortest_tour

    config = OracleConfig(command.rounds, command.rounds, command.seed)
    floor = runs[0].floor()
    oracle = near_shortest_tour(floor, [run.trail for run in runs], config)
    for run in runs:
        figures = compared(oracle, floor, run.trail)
        path = {"seen": oracle.seen, "path_m": oracle.path.round(3).tolist()}
        (run.folder / ORACLE).write_text(json.dumps(asdict(figures) | path, allow_nan=False) + "\n")
        draw_ways(run, oracle, metres(run.trail), run.folder / PICTURE)
        tour, bound = (shown(m, ".1f", " m") for m in (figures.oracle_m, figures.oracle_lower_bound_m))
        ratio = shown(figures.competitive_ratio, ".2f")
        yield f"{str(run.folder)[-31:]:<32}{metres(run.trail):>8.1f} m{tour:>10}{bound:>10}{ratio:>8}"


def shown(figure: float | None, form: str, unit: str = "") -> str:
    """As in a table; nothing where there is none."""
    return "" if figure is None else f"{figure:{form}}{unit}"


if __name__ == "__main__":
    sys.exit(main())
