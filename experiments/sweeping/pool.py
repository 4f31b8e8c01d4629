"""Runs jobs, many at a time, here or elsewhere, and hands back their results as they come.

A *lane* is where jobs run. Each local lane is one spawned process with a pool of its own, so that when a
process is killed it is plain which run it had, and no other run is lost (one pool of many processes would
break as a whole). A cluster is one wide lane. Jobs are taken from their iterator only when a lane is free.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from multiprocessing.synchronize import Event
from typing import Protocol

from experiments.sweeping.jobs import Job, Result, crashed, run_job

Work = Callable[[Job], Result]
"""What is done with each job. It is sent to other processes by its module and name."""
DEATHS = 2
"""A run whose process dies this often is given up."""
POLL_S = 0.3
"""How soon a wish to stop is heard."""


class Lane(Protocol):
    """Somewhere to run jobs."""

    queue: int
    """Jobs that it takes for each of its workers, the running one among them."""

    def workers(self) -> int:
        """How many jobs it runs at a time."""
        ...

    def submit(self, work: Work, job: Job) -> Future[Result]:
        """Start a job."""
        ...

    def revive(self) -> None:
        """Start anew after a death."""
        ...

    def stop(self) -> None:
        """Ask running jobs to end soon."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


class ProcessLane:
    """One process of its own on this machine, spawned: a fork would share threads and locks."""

    queue = 1

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._stop = self._context.Event()
        self._pool = self._fresh()

    def _fresh(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, self._context, initializer=_begin, initargs=(self._stop,))

    def workers(self) -> int:
        return 1

    def submit(self, work: Work, job: Job) -> Future[Result]:
        return self._pool.submit(work, job)

    def revive(self) -> None:
        self._pool.shutdown(wait=False)
        self._pool = self._fresh()

    def stop(self) -> None:
        self._stop.set()

    def close(self) -> None:
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)


def results(
    jobs: Iterable[Job], lanes: Sequence[Lane], work: Work, stop: Callable[[], bool] = lambda: False
) -> Iterator[Result]:
    """A result per job, as they come, until all are done or somebody wants to stop."""
    waiting, again = iter(jobs), deque[Job]()
    running: dict[Future[Result], tuple[Lane, Job]] = {}
    deaths = Counter[str]()
    while True:
        if stop():
            for lane in lanes:
                lane.stop()
            again.clear()
            waiting = iter(())
        for lane in lanes:
            _fill(lane, again, waiting, running, work)
        if not running:
            return
        done, _ = wait(running, timeout=POLL_S, return_when=FIRST_COMPLETED)
        for future in done:
            lane, job = running.pop(future)
            if future.cancelled():
                continue
            try:
                yield future.result()
            except BrokenExecutor:
                lane.revive()
                deaths[job.key] += 1
                if deaths[job.key] < DEATHS:
                    again.append(job)
                else:
                    yield crashed(job, f"its process was killed, {DEATHS} times")
            except Exception as error:  # of whoever carries jobs and results about; work itself raises none
                yield crashed(job, f"{type(error).__name__}: {error}")


def _fill(
    lane: Lane,
    again: deque[Job],
    waiting: Iterator[Job],
    running: dict[Future[Result], tuple[Lane, Job]],
    work: Work,
) -> None:
    """Give a lane as much as it takes; what died comes first."""
    free = lane.queue * lane.workers() - sum(owner is lane for owner, _ in running.values())
    for _ in range(free):
        job = again.popleft() if again else next(waiting, None)
        if job is None:
            return
        running[_submitted(lane, work, job)] = lane, job


def _submitted(lane: Lane, work: Work, job: Job) -> Future[Result]:
    """Started, if need be in place of a process that died while it had nothing to do."""
    try:
        return lane.submit(work, job)
    except BrokenExecutor:
        lane.revive()
        return lane.submit(work, job)


_stop: Event | None = None
"""In a process of a lane: set when its job should end soon."""


def is_stopping() -> bool:
    """Whether the job of this process should end."""
    return _stop is not None and _stop.is_set()


def explore(job: Job) -> Result:
    """The work of a sweep."""
    return run_job(job, is_stopping)


def _begin(stop: Event) -> None:
    """Prepare a process: Ctrl-C, which reaches the whole group, is left to the parent to pass on; and should
    the parent be killed, nobody is left behind."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
