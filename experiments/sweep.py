"""Many buildings, one result line each, and a table.

    python -m experiments.sweep --out runs/sweep --kinds office maze --seeds 0 20

Every run is a process's own, so that a crash costs its own run only. Results are appended to
results.jsonl as they come; a sweep that was stopped and is started again leaves out what is there.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from experiments import config_file
from experiments.config import ExperimentConfig
from sim.generators import Kind

RESULTS = "results.jsonl"
TABLE = "table.txt"


@dataclass(frozen=True)
class Sweep:
    """Explore many buildings and gather what came of it."""

    out: Path = Path("runs/sweep")
    """Where results.jsonl and table.txt go. Results that are there already are kept and not run again."""
    kinds: tuple[Kind, ...] = ("office", "apartment", "maze", "hall")
    """Kinds of building."""
    seeds: tuple[int, int] = (0, 20)
    """Seeds, from FIRST up to but without LAST."""
    plans: tuple[Path, ...] = ()
    """Explore these floor plans, with every seed, instead of generated buildings."""
    workers: int = 1
    """Processes at a time."""
    experiment: Annotated[ExperimentConfig, tyro.conf.arg(name="")] = field(default_factory=ExperimentConfig)

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise ValueError(f"workers must be at least 1, got {self.workers}")
        if not 0 <= self.seeds[0] < self.seeds[1]:
            raise ValueError(f"seeds must be FIRST LAST with 0 <= FIRST < LAST, got {self.seeds}")

    def experiments(self) -> Iterator[ExperimentConfig]:
        """Every run of the sweep."""
        for seed in range(*self.seeds):
            for plan in self.plans:
                yield replace(self.experiment, seed=seed, plan=plan)
            for kind in self.kinds if not self.plans else ():
                building = replace(self.experiment.building, kind=kind)
                yield replace(self.experiment, seed=seed, building=building)


def key_of(config: ExperimentConfig) -> str:
    """Names a run by everything that decides its result."""
    plain = json.dumps(config_file.to_plain(config), sort_keys=True)
    return hashlib.sha256(plain.encode()).hexdigest()[:16]


def result_of(config: ExperimentConfig) -> dict[str, Any]:
    """Run one experiment without recording. A mistake or a crash is a result too."""
    from experiments.experiment import prepare
    from experiments.run import run
    from experiments.summary import finite, summarise

    name = config.plan.stem if config.plan is not None else config.building.kind
    row: dict[str, Any] = {"key": key_of(config), "name": name, "seed": config.seed}
    try:
        return row | finite(asdict(summarise(run(prepare(config)))))
    except Exception as error:
        return row | {"status": "crashed", "error": f"{type(error).__name__}: {error}"}


def sweep(job: Sweep) -> list[dict[str, Any]]:
    """Run what is missing or crashed; return all rows of the sweep."""
    from tqdm import tqdm

    job.out.mkdir(parents=True, exist_ok=True)
    file = job.out / RESULTS
    wanted = {key_of(config): config for config in job.experiments()}
    rows = {row["key"]: row for row in read(file) if row["key"] in wanted and row["status"] != "crashed"}
    missing = [config for key, config in wanted.items() if key not in rows]
    end_last_line(file)
    with file.open("a") as out, tqdm(total=len(wanted), initial=len(rows), unit="run") as bar:
        for row in results(missing, job.workers):
            out.write(json.dumps(row, allow_nan=False) + "\n")
            out.flush()
            rows[row["key"]] = row
            bar.update()
    return [rows[key] for key in wanted if key in rows]


def read(file: Path) -> Iterator[dict[str, Any]]:
    """The rows of a results file; a last line cut short by a kill is left out."""
    for line in file.read_text().splitlines() if file.exists() else ():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            continue


def end_last_line(file: Path) -> None:
    """Close a line that a kill cut short, so that the next one does not continue it."""
    if file.exists() and (text := file.read_bytes()) and not text.endswith(b"\n"):
        file.write_bytes(text + b"\n")


def results(configs: Sequence[ExperimentConfig], workers: int) -> Iterator[dict[str, Any]]:
    """A row per config, as they come. Processes are spawned: a fork would share threads and locks."""
    waiting = {key_of(config): config for config in configs}
    tries = dict.fromkeys(waiting, 0)
    while waiting:
        with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
            futures: dict[Future[dict[str, Any]], str] = {
                pool.submit(result_of, config): key for key, config in waiting.items()
            }
            for future in as_completed(futures):
                key = futures[future]
                try:
                    row = future.result()
                except BrokenProcessPool:  # a worker was killed: whoever was running pays, the rest go on
                    tries[key] += 1
                    continue
                del waiting[key]
                yield row
        for key in [key for key in waiting if tries[key] >= MOST_TRIES]:
            del waiting[key]
            yield {"key": key, "status": "crashed", "error": "its process was killed"}


MOST_TRIES = 3
"""A run whose process pool dies this often is given up."""

COLUMNS = (
    "runs",
    "complete",
    "honest",
    "explored",
    "worst",
    "wrong",
    "recall",
    "p95 m",
    "hits",
    "metres",
    "x real",
)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """One line per kind of building: medians, and the worst where that is what counts."""
    import numpy as np

    lines = [f"{'':<16}" + "".join(f"{name:>10}" for name in COLUMNS)]
    for name in sorted({row.get("name", "?") for row in rows}):
        group = [row for row in rows if row.get("name", "?") == name]
        done = [row for row in group if row["status"] != "crashed"]
        if not done:
            lines.append(f"{name:<16}{len(group):>10}  all crashed")
            continue

        def of(field: str, done: list[dict[str, Any]] = done) -> Any:
            return np.array([row[field] for row in done], float)

        p95 = np.array([row["wall_error_m"]["p95"] for row in done], float)
        hits = sum(row["collisions"]["events"] for row in done)
        complete = sum(row["status"] in ("complete", "sealed_in") for row in done)
        cells = [
            f"{len(group)}",
            f"{complete}",
            f"{sum(row['honest'] for row in done)}",
            f"{np.median(of('explored')):.2%}",
            f"{of('explored').min():.2%}",
            f"{of('wrong').max():.3%}",
            f"{of('wall_recall').min():.2%}",
            f"{p95.max():.3f}",
            f"{hits:.0f}",
            f"{np.median(of('path_length_m')):.0f}",
            f"{np.median(of('real_time_factor')):.0f}",
        ]
        lines.append(f"{name:<16}" + "".join(f"{cell:>10}" for cell in cells))
    return "\n".join(lines)


def main() -> int:
    """Exit status 0 if every run is complete and honest, 1 if not, 2 for a user's mistake."""
    try:
        job = tyro.cli(Sweep, prog="python -m experiments.sweep")
    except ValueError as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return 2
    rows = sweep(job)
    text = table(rows)
    (job.out / TABLE).write_text(text + "\n")
    print(text)
    good = all(row["status"] in ("complete", "sealed_in") and row["honest"] for row in rows)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
