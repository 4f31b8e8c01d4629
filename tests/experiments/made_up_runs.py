"""What the tests of sweeps do instead of exploring. Workers import it by its name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from experiments.sweeping.jobs import Job, Result, Row

DEADLY_SEED, FATAL_SEED = 1, 2


def row_of(job: Job, **changes: Any) -> Row:
    """A result as a run would leave it."""
    metres = 100.0 + job.config.seed
    figures = {
        "status": "complete",
        "honest": True,
        "explored": 0.998,
        "wrong": 0.0004,
        "wall_recall": 0.99,
        "wall_error_m": {"mean": 0.01, "p95": 0.05},
        "collisions": {"events": 0, "duration_s": 0.0},
        "path_length_m": metres,
        "sim_time_s": 3.0 * metres,
        "real_time_factor": 101.0,
        "unknown_left": [],
        "map_sha256": "0",
        "curve": {
            "seconds": [0.0, metres, 3.0 * metres],
            "metres": [0.0, metres / 2.0, metres],
            "explored": [0.1, 0.8, 0.998],
        },
        "run_s": 0.0,
    }
    return job.identity() | figures | changes


def quick(job: Job) -> Result:
    """Done at once."""
    return Result(row_of(job), b"picture")


def killed_once(job: Job) -> Result:
    """Seed 1 kills its process the first time, seed 2 each time."""
    been_here = Path(os.environ["MADE_UP_RUNS"]) / str(job.config.seed)
    first_time = not been_here.exists()
    been_here.touch()
    if job.config.seed == FATAL_SEED or (job.config.seed == DEADLY_SEED and first_time):
        os._exit(9)
    return quick(job)


def with_process(job: Job) -> Result:
    """Tells which process did it."""
    return Result(row_of(job, process=os.getpid()))


def interrupted(job: Job) -> Result:
    """As when somebody asked to stop in the middle of a run."""
    return Result(row_of(job, status="interrupted"))


def longer(job: Job) -> Result:
    """Drives a tenth more than `quick`, give or take."""
    metres = row_of(job)["path_length_m"] * (1.1 + 0.01 * (job.config.seed % 3))
    return Result(row_of(job, path_length_m=metres))


def failing(job: Job) -> Result:
    """Seed 3 gives up half way."""
    if job.config.seed != 3:
        return quick(job)
    return Result(row_of(job, status="stuck", explored=0.5, path_length_m=40.0), b"picture")
