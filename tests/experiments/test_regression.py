"""One small building of each kind, explored to the end: what must not get worse.

The figures are lower bounds of what was measured when this was written, with a little air.
"""

import pytest

from experiments.config import ExperimentConfig, PoseSource
from experiments.experiment import prepare
from experiments.run import Run, run
from experiments.summary import Summary, summarise
from occmap.decision import Reason
from sim.faults import FaultsConfig
from sim.generators import BuildingConfig, Kind

SMALL: dict[Kind, tuple[float, float]] = {
    "office": (12.0, 10.0),
    "apartment": (10.0, 8.0),
    "maze": (8.0, 8.0),
    "hall": (12.0, 10.0),
}


def explored(kind: Kind, pose: PoseSource = "truth", drift_scale: float = 1.0) -> tuple[Run, Summary]:
    building = BuildingConfig(kind, size_m=SMALL[kind])
    config = ExperimentConfig(
        seed=11, pose=pose, drift_scale=drift_scale, building=building, time_limit_s=1200.0
    )
    done = run(prepare(config))
    return done, summarise(done)


@pytest.mark.parametrize("kind", SMALL)
def test_a_small_building_is_explored_to_the_end(kind):
    done, summary = explored(kind)
    assert summary.status == "complete"
    assert summary.honest
    assert summary.explored >= 0.995
    assert summary.wrong <= 0.0015
    assert summary.wall_recall >= 0.98
    assert summary.wall_error_m["p95"] <= 1.5 * 0.05
    assert summary.collisions == {"events": 0, "duration_s": 0.0}
    reasons = {left.reason for left in done.last.decision.unknown_left}
    assert reasons.isdisjoint({Reason.GAVE_UP, Reason.UNSAFE})


@pytest.mark.parametrize("kind", SMALL)
def test_slam_holds_the_map_of_a_small_building_on_bad_wheels(kind):
    _, summary = explored(kind, "slam", drift_scale=3.0)
    assert summary.status == "complete"
    assert summary.explored >= 0.99
    assert summary.wrong <= 0.005
    assert summary.wall_recall >= 0.97
    assert summary.wall_error_m["p95"] <= 2.0 * 0.05 + 1e-6
    assert summary.collisions == {"events": 0, "duration_s": 0.0}
    assert summary.ate_m < 0.05


def apartment_with(faults: FaultsConfig) -> Summary:
    building = BuildingConfig("apartment", size_m=SMALL["apartment"])
    return summarise(run(prepare(ExperimentConfig(seed=11, pose="truth", building=building, faults=faults))))


def test_a_robot_shut_in_says_so_and_is_judged_by_what_it_could_still_reach():
    summary = apartment_with(FaultsConfig(close_doors_at_s=15.0))
    assert summary.status == "sealed_in"
    assert summary.honest
    assert summary.explored < 0.9  # of what could once be explored
    assert any(left["reason"] == "sealed" for left in summary.unknown_left)


def test_a_robot_whose_wheels_lost_the_floor_says_that_it_is_stuck():
    assert apartment_with(FaultsConfig(lift_at_s=10.0)).status == "stuck"


def test_wheels_that_drift_smear_the_walls_and_the_scores_show_it():
    config = ExperimentConfig(
        seed=11,
        pose="odometry",
        drift_scale=3.0,
        building=BuildingConfig("apartment", size_m=SMALL["apartment"]),
        time_limit_s=120.0,
    )
    summary = summarise(run(prepare(config)))
    assert summary.ate_m > 0.02
    assert summary.drift_per_m > 0.001
    assert summary.wall_error_m["p95"] > 0.05
