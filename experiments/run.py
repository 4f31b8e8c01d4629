"""One experiment from its first scan to its last, watched, timed and scored."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from experiments.curves import ScoreCurve
from experiments.episode import Step, episode
from experiments.experiment import Experiment
from experiments.motion import DriveLog
from experiments.outcome import Outcome
from experiments.recorders import Recorder
from experiments.trajectory import TrajectoryLog
from experiments.warm_up import warm_up
from occmap.stopwatch import Stopwatch
from sim.faults import PhysicsFault
from sim.robot import Truth


@dataclass(frozen=True)
class Run:
    """All that is left of an experiment when it is over."""

    experiment: Experiment
    outcome: Outcome
    last: Step
    """Its last scan, and what it made of it."""
    end: Truth
    """Where all had come to when the clock stopped: up to one act later than the last scan."""
    curve: ScoreCurve
    trajectory: TrajectoryLog
    drives: DriveLog
    min_clearance_m: float
    stopwatch: Stopwatch
    """Of the loop and what was done beside it; the experiment has its own for what came before."""
    loop_s: float
    """Wall time of the see-think-act loop and its recorders; truth and scoring are left out."""
    fault: str = ""
    """What went wrong, if the outcome is PHYSICS_FAULT."""
    unrecorded: tuple[str, ...] = ()
    """What recorders failed of as they closed: the run itself is none the worse for it."""


def run(
    experiment: Experiment,
    recorders: Callable[[ScoreCurve], Sequence[Recorder]] = lambda curve: (),
    stop: Callable[[], bool] = lambda: False,
) -> Run:
    """Explore until the end, or until `stop` says so between two scans.

    The recorders are made here, once the curve that they may read exists, and closed here.
    """
    curve = ScoreCurve(experiment.scorer)
    trajectory, drives = TrajectoryLog(experiment.world_from_map), DriveLog()
    stopwatch = Stopwatch()
    with stopwatch.lap("warm_up"):
        warm_up(experiment.config)
    watchers = recorders(curve)
    fault, interrupted, min_clearance_m = "", False, float("inf")
    unrecorded: tuple[str, ...] = ()
    last: Step | None = None
    begun = time.perf_counter()
    try:
        for last in episode(experiment.robot, experiment.explorer, experiment.config.time_limit_s, stopwatch):
            min_clearance_m = min(min_clearance_m, last.truth.clearance_m)
            with stopwatch.lap("scoring"):
                curve.record(last)
                trajectory.record(last)
                drives.record(last)
            with stopwatch.lap("recording"):
                for watcher in watchers:
                    watcher.record(last)
            if interrupted := stop():
                break
    except PhysicsFault as error:
        fault = str(error)
    finally:
        loop_s = time.perf_counter() - begun - stopwatch.total_s("scoring") - stopwatch.total_s("truth")
        if last is not None:
            curve.sample(last)  # recorders may show the final score as they close
        experiment.explorer.planner.release()  # drawing takes memory, too
        unrecorded = _close(watchers)
    assert last is not None, "the first scan comes before the first physics step and the time limit"
    outcome = _outcome(last, bool(fault), interrupted)
    end = last.truth if fault else experiment.robot.truth()
    return Run(
        experiment, outcome, last, end, curve, trajectory, drives, min_clearance_m, stopwatch, loop_s, fault,
        unrecorded,
    )  # fmt: skip


def _outcome(last: Step, is_fault: bool, is_interrupted: bool) -> Outcome:
    if is_fault:
        return Outcome.PHYSICS_FAULT
    ended = Outcome.of(last.decision.status)
    return Outcome.INTERRUPTED if is_interrupted and ended is Outcome.TIME_LIMIT else ended


def _close(watchers: Sequence[Recorder]) -> tuple[str, ...]:
    """Close every one of them, and tell which failed of what: nobody else's file must be lost to it."""
    failures: list[str] = []
    for watcher in watchers:
        try:
            watcher.close()
        except Exception as failure:
            failures.append(f"{type(watcher).__name__}: {type(failure).__name__}: {failure}")
    return tuple(failures)
