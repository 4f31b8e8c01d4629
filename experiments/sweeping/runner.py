"""Does what is missing of a sweep, and shows how far it has come."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from experiments.sweeping.groups import is_good
from experiments.sweeping.jobs import CRASHED, INTERRUPTED, Job, Result
from experiments.sweeping.pool import Lane, ProcessLane, Work, results
from experiments.sweeping.store import Store
from experiments.words import counted

if TYPE_CHECKING:
    from tqdm import tqdm

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@contextmanager
def open_lanes(workers: int, scheduler: str | None) -> Iterator[list[Lane]]:
    """Where the runs go, closed again at the end."""
    with ExitStack() as stack:
        lanes: list[Lane] = []
        if scheduler is not None:
            from experiments.sweeping.cluster import ClusterLane

            lanes.append(ClusterLane(scheduler))
        else:
            one_thread_each()
            lanes.extend(ProcessLane() for _ in range(workers))
        for lane in lanes:
            stack.callback(lane.close)
        yield lanes


def one_thread_each() -> None:
    """Processes that we spawn compute on one thread, unless the user has said otherwise: as many runs at a
    time as there are cores is the better use of them."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


@dataclass
class Tally:
    """What a sweep did, in this process's lifetime."""

    begun: float
    done: int = 0
    bad: int = 0
    run_s: float = 0.0
    """Of all runs together: building, exploring and scoring."""
    crashed: int = 0
    first_crash: str = ""

    def add(self, result: Result) -> None:
        """Count a run."""
        self.done += 1
        if result.row["status"] == CRASHED:
            self.crashed += 1
            self.first_crash = self.first_crash or "{name} {seed}: {error}".format_map(result.row)
        self.bad += not is_good(result.row)
        self.run_s += result.row.get("run_s", 0.0)

    def text(self, workers: int) -> str:
        """Throughput, and how much of it was not spent on runs."""
        if not self.done:
            return "nothing was left to run"
        wall_s = time.monotonic() - self.begun
        share = self.run_s / (wall_s * workers)
        pace = (
            f"{counted(self.done, 'run')} in {wall_s:.0f} s, {60.0 * self.done / wall_s:.2f} a minute; "
            f"{workers} at a time spent {share:.1%} of their time on runs"
        )
        return f"{pace}\n{self.crashed} crashed, the first: {self.first_crash}" if self.crashed else pace


def run_missing(
    jobs: Iterable[Job], total: int, store: Store, lanes: Sequence[Lane], work: Work, stop: Callable[[], bool]
) -> Tally:
    """Run the jobs whose result is not there, and keep each as it comes."""
    from tqdm import tqdm

    tally = Tally(time.monotonic())
    with tqdm(total=total, unit="run", smoothing=0.05, file=sys.stderr, dynamic_ncols=True) as bar:
        for result in results(missing(jobs, store, bar, stop), lanes, work, stop):
            if result.row["status"] == INTERRUPTED:
                continue
            store.write(result)
            tally.add(result)
            bar.set_postfix_str(f"{tally.bad} not good" if tally.bad else "", refresh=False)
            bar.update()
    return tally


def missing(jobs: Iterable[Job], store: Store, bar: tqdm, stop: Callable[[], bool]) -> Iterator[Job]:
    """The jobs whose result is not there; the others count as done from the beginning, so that the time left
    is told by the runs that take time."""
    for job in jobs:
        if stop():
            return
        if store.has(job.key):
            bar.initial += 1
            bar.update()
        else:
            yield job
