"""How well and how fast recorded logs are mapped, and pose graphs solved: the tables of docs/replay.md.

python -m experiments.benchmark_slam intel.clf.bz2 fr079.clf.bz2 manhattanOlson3500.g2o
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.exit_status import MISTAKE

if TYPE_CHECKING:
    from experiments.relations import RelationsScore


PUBLISHED = {"intel": "0.0229 m, 0.453 deg", "fr079": "0.0452 m, 0.538 deg"}
"""Cartographer's mean absolute errors: Hess et al., "Real-time loop closure in 2D LIDAR SLAM", 2016."""

LOG_COLUMNS = (
    "log",
    "scans",
    "translation, m",
    "rotation, deg",
    "Cartographer's",
    "odometry's",
    "ms a scan: median, mean, max",
)
GRAPH_COLUMNS = ("pose graph", "nodes", "edges", "chi2 at the start", "chi2", "iterations", "ms")


@dataclass(frozen=True)
class Command:
    """Map recorded logs and solve pose graphs with the defaults, and print a table of each.

    Of logs: mean ± standard deviation of the absolute errors over all true relations (Kümmerle et al. 2009).
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Logs, each with its relations beside it (NAME.relations for NAME.clf.bz2), and pose graphs (.g2o)."""

    def __post_init__(self) -> None:
        if not self.files:
            raise ValueError("name at least one log or pose graph")
        for file in self.files:
            if not file.exists():
                raise ValueError(f"there is no file {file}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables as they come; the exit status is 2 for a user's mistake."""
    try:
        command = tyro.cli(Command, prog="python -m experiments.benchmark_slam", args=arguments)
        graphs = [file for file in command.files if file.suffix == ".g2o"]
        for line in lines([file for file in command.files if file not in graphs], graphs):
            print(line, flush=True)
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    return 0


def lines(logs: list[Path], graphs: list[Path]) -> Iterator[str]:
    """One table for the logs, one for the pose graphs, and what produced them."""
    from experiments.summary_parts import versions

    if logs:
        yield header(LOG_COLUMNS)
        yield from map(log_row, logs)
        yield ""
    if graphs:
        yield header(GRAPH_COLUMNS)
        yield from map(graph_row, graphs)
        yield ""
    yield ", ".join(f"{name} {version}" for name, version in versions().items())


def header(columns: Sequence[str]) -> str:
    return f"{row(columns)}\n{row(['---'] * len(columns))}"


def row(cells: Sequence[object]) -> str:
    """A line of a Markdown table."""
    return f"| {' | '.join(map(str, cells))} |"


def log_row(path: Path) -> str:
    """Map one log and say what came of it."""
    from experiments.logs.log import read_log
    from experiments.relations import relations_beside, score_relations
    from experiments.replaying.results import quantiles_ms
    from experiments.replaying.runner import ReplayConfig, replay

    name = path.name.split(".")[0]
    log, relations = read_log(path), relations_beside(path)
    slam, odometry = (replay(log, ReplayConfig(pose=pose)) for pose in ("slam", "odometry"))
    scores = [
        None if relations is None else score_relations(run.laser, relations) for run in (slam, odometry)
    ]
    ms = quantiles_ms(slam.stopwatch)
    cells = (
        name,
        len(log.observations),
        *error_cells(scores[0]),
        PUBLISHED.get(name, ""),
        odometry_cell(scores[1]),
        f"{ms['p50']:.2f}, {ms['mean']:.2f}, {ms['max']:.1f}",
    )
    return row(cells)


def error_cells(score: RelationsScore | None) -> tuple[str, str]:
    """Translation and rotation; empty without true relations to score against."""
    if score is None:
        return "", ""
    translation, rotation = score.translation_m, score.rotation_deg
    return f"{translation.mean:.4f} ± {translation.std:.4f}", f"{rotation.mean:.3f} ± {rotation.std:.3f}"


def odometry_cell(score: RelationsScore | None) -> str:
    """Both means, which are large; empty without true relations."""
    if score is None:
        return ""
    return f"{score.translation_m.mean:.2f} m, {score.rotation_deg.mean:.1f} deg"


def graph_row(path: Path) -> str:
    """Solve one pose graph from where its file starts."""
    from experiments.logs.g2o import read_g2o

    read_g2o(path).iterate()  # compiles and loads the kernels
    graph = read_g2o(path)
    begun = time.perf_counter()
    start = graph.cost()
    iterations, converged = 0, False
    while not converged:
        converged = graph.iterate().converged
        iterations += 1
    ms = 1e3 * (time.perf_counter() - begun)
    cells = (
        path.stem,
        len(graph.poses),
        len(graph.ends),
        f"{start:.0f}",
        f"{graph.cost():.3f}",
        iterations,
        f"{ms:.0f}",
    )
    return row(cells)


if __name__ == "__main__":
    sys.exit(main())
