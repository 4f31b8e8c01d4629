"""What a process costs: its start, the compilation of the kernels, its memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from experiments.benchmarking.figure import Figure

REPEATS = 3
HELP = "from experiments.command import parse; parse(['--help'])"
WARM_UP = (
    "from experiments.config import ExperimentConfig; from experiments.warm_up import warm_up; "
    "warm_up(ExperimentConfig(pose='{pose}'))"
)


def start() -> Iterator[Figure]:
    """From nothing to the first scan, in new processes: medians of several, but one first compilation."""
    yield Figure("import occmap", median(lambda: seconds("import occmap")), "s", "0.5")
    yield Figure("--help", median(lambda: seconds(HELP)), "s")
    for pose, more in (("truth", ""), ("slam", ", and slam's")):
        warm_up = WARM_UP.format(pose=pose)
        with tempfile.TemporaryDirectory() as cache:
            begun_s = time.perf_counter()
            yield Figure(f"kernels{more}, compiled for the first time", seconds(warm_up, cache), "s", "10")
            yield Figure("  wall time", time.perf_counter() - begun_s, "s")
            yield Figure(f"kernels{more}, from the cache", median(partial(seconds, warm_up, cache)), "s", "1")


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
