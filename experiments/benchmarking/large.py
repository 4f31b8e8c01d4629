"""What a scan costs in large buildings, beside what it costs in the default office."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from experiments.benchmarking.figure import Figure
from experiments.config import ExperimentConfig
from experiments.episode import episode
from experiments.experiment import prepare
from experiments.summary_parts import peak_memory_mb
from experiments.warm_up import warm_up
from occmap.stopwatch import Stopwatch
from sim.generators import BuildingConfig

STAGES = ("physics", "lidar", "mapping", "frontiers", "planning")
LARGE = (
    BuildingConfig(kind="office", size_m=(100.0, 100.0)),
    BuildingConfig(kind="hall", size_m=(200.0, 200.0)),
)
LIMIT_S = 100_000.0
"""Enough for any of them: they take hours of simulated time."""


@dataclass(frozen=True)
class Costs:
    """Of one exploration from beginning to end."""

    scan_ms: float
    """CPU time of the see-think-act loop."""
    stages_ms: dict[str, float]
    """Wall time of a scan by stage."""
    decision_ms: float
    """Median."""
    explored: float
    time_s: float
    path_length_m: float


def large(seed: int) -> Iterator[Figure]:
    """The default office first, then the large ones, each to its end. Takes long."""
    usual = costs(BuildingConfig(), seed)
    yield Figure("a scan in the default office", usual.scan_ms, "ms (CPU)")
    for building in LARGE:
        assert building.size_m is not None
        name = f"{building.kind} of {building.size_m[0]:.0f} m x {building.size_m[1]:.0f} m"
        found = costs(building, seed)
        yield Figure(f"{name}: a scan", found.scan_ms / usual.scan_ms, "x default office's", "1.5")
        for stage in STAGES:
            yield Figure(f"  {stage}", found.stages_ms[stage] / usual.stages_ms[stage], "x default office's")
        yield Figure("  a decision, median", found.decision_ms, "ms", "50")
        yield Figure("  peak memory, so far", peak_memory_mb(), "MB", "2000")
        yield Figure("  explored", 100.0 * found.explored, "%", "99")
        yield Figure("  driven", found.path_length_m, f"m in {found.time_s:.0f} s")


def costs(building: BuildingConfig, seed: int) -> Costs:
    """Explore one building to the end."""
    experiment = prepare(ExperimentConfig(seed=seed, pose="truth", building=building))
    warm_up(experiment.config)
    watch, begun = Stopwatch(), time.thread_time()
    (last,) = deque(episode(experiment.robot, experiment.explorer, LIMIT_S, watch), maxlen=1)
    spent_s, scans = time.thread_time() - begun, len(watch.laps_s["decision"])
    return Costs(
        scan_ms=1e3 * spent_s / scans,
        stages_ms={stage: 1e3 * watch.total_s(stage) / scans for stage in STAGES},
        decision_ms=1e3 * float(np.median(watch.laps_s["decision"])),
        explored=experiment.scorer.score(last.grid).explored,
        time_s=experiment.robot.time_s,
        path_length_m=last.truth.path_length_m,
    )
