"""Processes that run jobs, and what becomes of them."""

import os
import signal
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor

from experiments.sweeping.jobs import Job, jobs_of
from experiments.sweeping.matrix import Matrix
from experiments.sweeping.pool import ProcessLane, results
from tests.experiments.made_up_runs import quick, with_process


def kill(process: int, lane: ProcessLane, job: Job) -> None:
    """End a lane's process, and come back when the lane knows."""
    os.kill(process, signal.SIGKILL)
    try:
        while True:
            lane.submit(quick, job)
            time.sleep(0.01)
    except BrokenExecutor:
        pass


def test_a_process_that_is_killed_while_it_has_nothing_to_do_is_replaced():
    first, second = jobs_of(Matrix(kinds=("maze",), seeds=(0, 2)), code="")
    processes: list[int] = []
    lane = ProcessLane()

    def one_at_a_time() -> Iterator[Job]:
        yield first
        kill(processes[0], lane, first)
        yield second

    try:
        processes.extend(result.row["process"] for result in results(one_at_a_time(), [lane], with_process))
    finally:
        lane.close()
    assert len(set(processes)) == 2
