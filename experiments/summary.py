"""summary.json: what a run amounts to. A stable contract: fields may be added, never change meaning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from experiments.curves import MILESTONES, milestone
from experiments.experiment import closed_doors, floor_in_reach
from experiments.honesty import is_honest
from experiments.motion import motion
from experiments.outcome import Outcome
from experiments.run import Run
from experiments.summary_parts import map_sha256, peak_memory_mb, versions
from experiments.trajectory import absolute_error_m, drift_per_m
from occmap.decision import UnknownLeft
from occmap.geometry import Pose2
from occmap.stopwatch import Stopwatch

MEASURED = ("wall_time_s", "real_time_factor", "wall_time_by_stage_s", "decision_ms", "peak_memory_mb")
"""The fields that depend on the machine and the moment; all others follow from the config."""
STAGES = ("physics", "lidar", "localization", "mapping", "frontiers", "planning", "recording")
"""Of the see-think-act loop."""
APART = ("building", "warm_up", "truth", "scoring")
"""Timed too, but not part of wall_time_s."""


@dataclass(frozen=True)
class Summary:
    """One field of summary.json each; see the README for what they mean."""

    status: str
    honest: bool
    explored: float
    known: float
    wrong: float
    wall_recall: float
    wall_error_m: dict[str, float]
    explorable_area_m2: float
    path_length_m: float
    sim_time_s: float
    wall_time_s: float
    real_time_factor: float
    wall_time_by_stage_s: dict[str, float]
    collisions: dict[str, float]
    min_clearance_m: float
    ate_m: float
    drift_per_m: float
    replans: int
    goal_switches: int
    motion: dict[str, float]
    milestones: dict[str, dict[str, float] | None]
    decision_ms: dict[str, float]
    unknown_left: list[dict[str, Any]]
    building: dict[str, Any]
    seed: int
    peak_memory_mb: float
    map_sha256: str
    versions: dict[str, str]
    oracle_m: float | None
    oracle_lower_bound_m: float | None
    competitive_ratio: float | None


def summarise(run: Run) -> Summary:
    """Everything that summary.json says about a run."""
    experiment, truth, decision = run.experiment, run.end, run.last.decision
    score = run.curve.latest.score
    true, believed = run.trajectory.true, run.trajectory.believed
    unknown_left = experiment.explorer.certificate()
    return Summary(
        status=run.outcome.value,
        honest=is_run_honest(run, unknown_left),
        explored=score.explored,
        known=score.known,
        wrong=score.wrong,
        wall_recall=score.wall_recall,
        wall_error_m={"mean": score.wall_error_mean_m, "p95": score.wall_error_p95_m},
        explorable_area_m2=experiment.scorer.explorable_area_m2,
        path_length_m=truth.path_length_m,
        sim_time_s=truth.time_s,
        wall_time_s=run.loop_s,
        real_time_factor=truth.time_s / run.loop_s,
        wall_time_by_stage_s={
            stage: run.stopwatch.total_s(stage) + experiment.stopwatch.total_s(stage)
            for stage in (*STAGES, *APART)
        },
        collisions={"events": truth.collision_events, "duration_s": truth.collision_duration_s},
        min_clearance_m=run.min_clearance_m,
        ate_m=absolute_error_m(true, believed),
        drift_per_m=drift_per_m(true, believed),
        replans=decision.replans,
        goal_switches=decision.goal_switches,
        motion=motion(true, run.drives.drives, truth.path_length_m, truth.time_s),
        milestones={str(percent): milestone(run.curve.samples, percent / 100.0) for percent in MILESTONES},
        decision_ms=_quantiles_ms(run.stopwatch),
        unknown_left=_rows(unknown_left, experiment.world_from_map),
        building=experiment.building_summary,
        seed=experiment.config.seed,
        peak_memory_mb=peak_memory_mb(),
        map_sha256=map_sha256(run.last.grid),
        versions=versions(),
        **oracle_figures(run),
    )


def is_run_honest(run: Run, unknown_left: Sequence[UnknownLeft]) -> bool:
    """Whether a run's status agrees with the truth: from the start, or, shut in, from where the robot is.

    A robot that squeezed in somewhere reaches nothing from there, by the truth's margins.
    """
    world = run.experiment.robot.world
    if run.outcome is Outcome.SEALED_IN and not closed_doors(world):
        return False
    scorer = run.experiment.scorer_at_the_end(run.outcome)
    start = world.world_from_robot if run.outcome is Outcome.SEALED_IN else scorer.world_from_map
    return is_honest(
        run.outcome,
        scorer.unexplored(run.last.grid),
        unknown_left,
        scorer.truth,
        scorer.world_from_map,
        lambda: floor_in_reach(run.experiment.config, scorer.truth, start, world.body_radius_m),
    )


def oracle_figures(run: Run) -> dict[str, float | None]:
    """How short the way could have been, if that was asked for; doors that close leave no answer."""
    config = run.experiment.config
    is_asked = config.oracle and config.faults.close_doors_at_s is None
    if not is_asked or run.outcome is Outcome.INTERRUPTED:
        return dict.fromkeys(("oracle_m", "oracle_lower_bound_m", "competitive_ratio"))
    from experiments.oracle.figures import oracle_of  # compiles for some seconds

    return asdict(oracle_of(run))


def _quantiles_ms(stopwatch: Stopwatch) -> dict[str, float]:
    laps_ms = 1e3 * np.array(stopwatch.laps_s["decision"])
    p50, p99 = np.percentile(laps_ms, (50, 99))
    return {"p50": float(p50), "p99": float(p99), "max": float(laps_ms.max())}


def _rows(unknown_left: Sequence[UnknownLeft], world_from_map: Pose2) -> list[dict[str, Any]]:
    """The certificate, in `world`."""
    rows = []
    for left in unknown_left:
        x_m, y_m = world_from_map.apply(np.array([left.in_map]))[0]
        rows.append(
            {
                "x_m": float(x_m),
                "y_m": float(y_m),
                "size_m": left.size_m,
                "reason": left.reason.value,
                "why": left.why,
            }
        )
    return rows
