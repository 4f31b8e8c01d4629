"""What things cost, beside what they may cost.

    python -m experiments.benchmark
    python -m experiments.benchmark --parts loop start

Times are CPU time of one core where nothing else is said; ratios compare figures of one and the same run.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import tyro

from occmap.stopwatch import Stopwatch

Part = Literal["loop", "recording", "start", "memory"]
REPEATS = 3


@dataclass(frozen=True)
class Figure:
    """One line of the table."""

    name: str
    value: float
    unit: str
    aim: str = ""


@dataclass(frozen=True)
class Benchmark:
    """Measure what the parts of a run cost."""

    parts: tuple[Part, ...] = get_args(Part)
    """loop: the whole of it, beside physics and lidar alone. recording: what rerun adds.
    start: imports and compilation. memory: a building of 60 m x 60 m."""
    seed: int = 0
    """Of the office that is explored."""


def loop(seed: int) -> Iterator[Figure]:
    """The default office from beginning to end, and the world alone in the same office."""
    from experiments.benchmark_sim import benchmark_sim
    from experiments.config import ExperimentConfig
    from experiments.episode import episode
    from experiments.experiment import prepare, warm_up

    experiment = prepare(ExperimentConfig(seed=seed))
    warm_up(experiment.config)
    robot, watch = experiment.robot, Stopwatch()
    wall, cpu = time.perf_counter(), time.process_time()
    (last,) = deque(episode(robot, experiment.explorer, experiment.config.time_limit_s, watch), maxlen=1)
    wall_s, cpu_s = time.perf_counter() - wall, time.process_time() - cpu
    alone = benchmark_sim(experiment.building).sim_seconds_per_cpu_second
    yield Figure("whole loop, wall time", robot.time_s / wall_s, "x real time", "100")
    yield Figure("whole loop, CPU time", robot.time_s / cpu_s, "x real time", "100")
    yield Figure("physics and lidar alone, CPU time", alone, "x real time", "about 240")
    yield Figure("whole loop / physics and lidar alone", alone * cpu_s / robot.time_s, "x CPU time")
    for stage in ("physics", "lidar", "localization", "mapping", "frontiers", "planning"):
        yield Figure(f"  {stage}", 1e3 * watch.total_s(stage) / robot.time_s, "ms (wall) a simulated s")
    yield Figure("explored", 100.0 * experiment.scorer.score(last.grid).explored, "%", "99.5")


def recording(seed: int) -> Iterator[Figure]:
    """Two minutes of the same office with the recording on."""
    from experiments.config import ExperimentConfig
    from experiments.experiment import prepare
    from experiments.recorders.rerun_recorder import RerunRecorder
    from experiments.run import run

    experiment = prepare(ExperimentConfig(seed=seed, time_limit_s=120.0))
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "recording.rrd"
        truth, world_from_map = experiment.scorer.truth, experiment.world_from_map
        done = run(
            experiment,
            lambda curve: [RerunRecorder(file, experiment.building, world_from_map, curve, truth)],
        )
        laps_s = done.stopwatch.laps_s["recording"]
        yield Figure("recording", 1e3 * sum(laps_s) / len(laps_s), "ms a scan", "1")
        yield Figure(
            "recording's size", file.stat().st_size / 1e6 / done.end.time_s * 600.0, "MB in 10 min", "50"
        )


def start(seed: int) -> Iterator[Figure]:
    """From nothing to the first scan, in new processes: medians of several, but one first compilation."""
    yield Figure("import occmap", median(lambda: seconds("import occmap")), "s", "0.5")
    yield Figure("--help", median(lambda: seconds(HELP)), "s")
    with tempfile.TemporaryDirectory() as cache:
        yield Figure("kernels, compiled for the first time", seconds(WARM_UP, cache), "s", "20")
        yield Figure("kernels, from the cache", median(lambda: seconds(WARM_UP, cache)), "s")


def memory(seed: int) -> Iterator[Figure]:
    """The main job without recording on an office of 60 m x 60 m, in a process of its own."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "run"
        command = [
            sys.executable,
            "-m",
            "experiments.explore",
            "--no-record",
            "--no-video",
            "--out",
            str(out),
        ]
        size = ["--building.size-m", "60", "60", "--seed", str(seed)]
        subprocess.run([*command, *size], check=False, capture_output=True)
        summary = json.loads((out / "summary.json").read_text())
    yield Figure("60 m x 60 m: peak memory", summary["peak_memory_mb"], "MB", "500")
    yield Figure("60 m x 60 m: whole loop", summary["real_time_factor"], "x real time")
    yield Figure("60 m x 60 m: explored", 100.0 * summary["explored"], "%")


HELP = "from experiments.command import parse; parse(['--help'])"
WARM_UP = (
    "from experiments.config import ExperimentConfig; from experiments.experiment import warm_up; "
    "warm_up(ExperimentConfig())"
)


def seconds(code: str, cache: str | None = None) -> float:
    """CPU time of some code in a new process, less that of an empty one."""
    environment = os.environ | ({"NUMBA_CACHE_DIR": cache} if cache else {})

    def run(statement: str) -> float:
        before = cpu_of_children_s()
        subprocess.run(
            [sys.executable, "-c", statement], check=True, env=environment, stdout=subprocess.DEVNULL
        )
        return cpu_of_children_s() - before

    return run(code) - run("")


def cpu_of_children_s() -> float:
    """All child processes that have ended, together."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def median(measure: Callable[[], float]) -> float:
    """Of REPEATS measurements: others may be using the machine."""
    return sorted(measure() for _ in range(REPEATS))[REPEATS // 2]


PARTS: dict[Part, Callable[[int], Iterator[Figure]]] = {
    "loop": loop,
    "recording": recording,
    "start": start,
    "memory": memory,
}


def main() -> None:
    """Print a table, line by line as it is measured."""
    job = tyro.cli(Benchmark, prog="python -m experiments.benchmark")
    print(f"{'':<48}{'measured':>12}  {'aim':>10}")
    for part in job.parts:
        for figure in PARTS[part](job.seed):
            print(f"{figure.name:<48}{figure.value:>12.3g}  {figure.aim:>10}  {figure.unit}", flush=True)


if __name__ == "__main__":
    main()
