"""The same runs on a Dask cluster that is already there."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

from experiments.sweeping.jobs import Job, Result
from experiments.sweeping.pool import Work

CONNECT_S = 10.0
"""Longer than a scheduler takes to answer."""


class ClusterLane:
    """All workers of a cluster. They need this package, the same code, and the floor plans if there are any;
    they need not share a disk with us: results come back over the network."""

    queue = 2
    """The next job is there when one ends: none waits for the network."""

    def __init__(self, scheduler: str) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise ValueError("--scheduler needs dask: install occmap with its extra, occmap[dask]") from error
        try:
            self._client = Client(scheduler, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise ValueError(f"no Dask scheduler answers at {scheduler}: {error}") from error
        self._executor = self._client.get_executor(pure=False)

    def workers(self) -> int:
        """Grows and shrinks with the cluster; while it has no workers yet, a job waits for them."""
        threads: Any = self._client.nthreads()
        return max(1, sum(threads.values()))

    def submit(self, work: Work, job: Job) -> Future[Result]:
        return self._executor.submit(work, job)

    def revive(self) -> None:
        """Dask starts dead workers anew, and gives up a job that has killed several."""

    def stop(self) -> None:
        self._executor.shutdown(wait=False)

    def close(self) -> None:
        self._executor.shutdown(wait=False)
        self._client.close()
