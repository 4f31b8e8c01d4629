"""What the see-think-act loop costs, and what recording it adds."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from experiments.benchmarking.figure import Figure
from experiments.benchmarking.sim import benchmark_sim
from experiments.config import ExperimentConfig
from experiments.episode import episode
from experiments.experiment import Experiment, prepare
from experiments.run import run
from experiments.warm_up import warm_up
from occmap.stopwatch import Stopwatch

STAGES = ("physics", "lidar", "localization", "mapping", "frontiers", "planning")


def loop(seed: int) -> Iterator[Figure]:
    """The default office from beginning to end: known poses, the world alone, and slam."""
    known = Whole.of(ExperimentConfig(seed=seed, pose="truth"))
    alone = benchmark_sim(known.experiment.building).sim_seconds_per_cpu_second
    yield Figure("whole loop, wall time", known.time_s / known.wall_s, "x real time", "100")
    yield Figure("whole loop, CPU time", known.time_s / known.cpu_s, "x real time", "100")
    yield Figure("physics and lidar alone, CPU time", alone, "x real time", "about 240")
    yield Figure("whole loop / physics and lidar alone", alone * known.cpu_s / known.time_s, "x CPU time")
    yield from known.stages()
    yield Figure("explored", 100.0 * known.explored, "%", "99.5")
    slam = Whole.of(ExperimentConfig(seed=seed, pose="slam"))
    yield Figure("whole loop with slam, wall time", slam.time_s / slam.wall_s, "x real time", "60")
    yield Figure("whole loop with slam, CPU time", slam.time_s / slam.cpu_s, "x real time", "60")
    yield from slam.stages()
    yield Figure("explored with slam", 100.0 * slam.explored, "%", "99.5")


@dataclass(frozen=True)
class Whole:
    """One building explored to the end, and what that cost."""

    experiment: Experiment
    time_s: float
    wall_s: float
    cpu_s: float
    watch: Stopwatch
    explored: float

    @staticmethod
    def of(config: ExperimentConfig) -> Whole:
        """Explore until the end, without recorders or scoring on the way."""
        experiment = prepare(config)
        warm_up(config)
        robot, watch = experiment.robot, Stopwatch()
        wall, cpu = time.perf_counter(), time.process_time()
        (last,) = deque(episode(robot, experiment.explorer, config.time_limit_s, watch), maxlen=1)
        truth_s = watch.total_s("truth")  # what is read for scoring is no part of the loop
        wall_s, cpu_s = time.perf_counter() - wall - truth_s, time.process_time() - cpu - truth_s
        explored = experiment.scorer.score(last.grid).explored
        return Whole(experiment, robot.time_s, wall_s, cpu_s, watch, explored)

    def stages(self) -> Iterator[Figure]:
        """Milliseconds that each stage took for a simulated second."""
        for stage in STAGES:
            yield Figure(
                f"  {stage}", 1e3 * self.watch.total_s(stage) / self.time_s, "ms (wall) a simulated s"
            )


def recording(seed: int) -> Iterator[Figure]:
    """Two minutes of the same office with the recording on."""
    from experiments.recorders.rerun_recorder import RerunRecorder

    experiment = prepare(ExperimentConfig(seed=seed, pose="truth", time_limit_s=120.0))
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "recording.rrd"
        setting, truth = experiment.setting, experiment.scorer.truth
        done = run(experiment, lambda curve: [RerunRecorder(file, setting, curve, truth)])
        laps_s = done.stopwatch.laps_s["recording"]
        yield Figure("recording", 1e3 * sum(laps_s) / len(laps_s), "ms a scan", "1")
        yield Figure(
            "recording's size", file.stat().st_size / 1e6 / done.end.time_s * 600.0, "MB in 10 min", "50"
        )
