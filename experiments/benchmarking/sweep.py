"""What many runs cost beside the runs themselves, and what a second process is worth."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from experiments.benchmarking.figure import Figure
from experiments.sweeping.jobs import CRASHED, jobs_of
from experiments.sweeping.matrix import Matrix
from experiments.sweeping.pool import explore, results
from experiments.sweeping.runner import open_lanes
from experiments.sweeping.store import Store

RUNS = 20


def throughput(seed: int) -> Iterator[Figure]:
    """The same apartments one at a time and two at a time, from a standing start. Wall time: nothing else
    may be running."""
    one_a_minute, overhead = _swept(seed, workers=1)
    two_a_minute, _ = _swept(seed, workers=2)
    yield Figure("apartments, one worker", one_a_minute, "a minute")
    yield Figure("apartments, two workers", two_a_minute, "a minute")
    yield Figure("two workers / one", two_a_minute / one_a_minute, "", "1.8")
    yield Figure("a sweep's overhead, each run", 100.0 * overhead, "%", "3")


def _swept(seed: int, workers: int) -> tuple[float, float]:
    """(runs a minute, share of the time between two results that was not spent on the run)."""
    matrix = Matrix(kinds=("apartment",), seeds=(seed, seed + RUNS))
    ends_s, runs_s = [time.perf_counter()], []
    with tempfile.TemporaryDirectory() as place, open_lanes(workers, None) as lanes:
        store = Store.create(Path(place))
        for result in results(jobs_of(matrix), lanes, explore):
            if result.row["status"] == CRASHED:
                raise RuntimeError(result.row["error"])
            store.write(result)
            ends_s.append(time.perf_counter())
            runs_s.append(result.row["run_s"])
    a_minute = 60.0 * RUNS / (ends_s[-1] - ends_s[0])
    after_the_first_s = sum(runs_s[1:])
    return a_minute, (ends_s[-1] - ends_s[1]) / after_the_first_s - 1.0
