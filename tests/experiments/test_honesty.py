"""When a run may say that it is done."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from experiments.config import ExperimentConfig
from experiments.experiment import prepare
from experiments.honesty import is_honest
from experiments.outcome import Outcome
from experiments.run import run
from experiments.summary import is_run_honest
from occmap.decision import Reason, Status, UnknownLeft
from occmap.geometry import Pose2
from sim.generators import BuildingConfig
from sim.truth import TruthGrid
from sim.world import World

EVERYWHERE, NOWHERE = np.ones((30, 30), bool), np.zeros((30, 30), bool)
TRUTH = TruthGrid(0.1, (0.0, 0.0), np.zeros((30, 30), bool))
START = Pose2(1.0, 1.0, 0.0)


def hole(cells: int) -> np.ndarray:
    """A row of unexplored cells from (2.0, 2.0) on."""
    unexplored = np.zeros((30, 30), bool)
    unexplored[20, 20 : 20 + cells] = True
    return unexplored


def judged(
    outcome: Outcome, cells: int, unknown_left: Sequence[UnknownLeft] = (), reach: np.ndarray = EVERYWHERE
) -> bool:
    return is_honest(outcome, hole(cells), unknown_left, TRUTH, START, lambda: reach)


def left(x_in_map: float, y_in_map: float, reason: Reason) -> UnknownLeft:
    return UnknownLeft((x_in_map, y_in_map), 0.2, reason, "")


@pytest.mark.parametrize("outcome", [Outcome.COMPLETE, Outcome.SEALED_IN])
def test_saying_done_is_honest_if_no_more_than_a_footprint_is_left(outcome):
    assert judged(outcome, 9)
    assert not judged(outcome, 10)


@pytest.mark.parametrize("outcome", [Outcome.TIME_LIMIT, Outcome.STUCK, Outcome.INTERRUPTED])
def test_a_run_that_ended_early_may_leave_anything(outcome):
    assert judged(outcome, 10)


@pytest.mark.parametrize("reason", [Reason.GAVE_UP, Reason.UNSAFE])
def test_nothing_given_up_may_hide_explorable_area(reason):
    # in the world the frontier lies at (2.0, 2.0), beside the hole
    assert not judged(Outcome.COMPLETE, 5, [left(1.0, 1.0, reason)])
    assert not judged(Outcome.TIME_LIMIT, 5, [left(1.0, 1.0, reason)])
    assert judged(Outcome.COMPLETE, 5, [left(0.0, 1.0, reason)])  # elsewhere
    assert judged(Outcome.COMPLETE, 4, [left(1.0, 1.0, reason)])  # a speck


@pytest.mark.parametrize("reason", [Reason.TOO_NARROW, Reason.SEALED])
def test_what_lies_behind_a_slot_may_be_left_if_it_is_listed_and_no_body_gets_there(reason):
    slot = left(1.0, 1.0, reason)
    assert judged(Outcome.COMPLETE, 10, [slot], reach=NOWHERE)
    assert not judged(Outcome.COMPLETE, 10, [slot], reach=EVERYWHERE)  # the body fits after all
    assert not judged(Outcome.COMPLETE, 10, [], reach=NOWHERE)  # not listed
    assert not judged(Outcome.COMPLETE, 10, [left(0.0, 1.0, reason)], reach=NOWHERE)  # listed elsewhere
    assert not judged(Outcome.COMPLETE, 10, [left(1.0, 1.0, Reason.SPECK)], reach=NOWHERE)


def test_the_explorers_last_word_becomes_the_outcome():
    assert Outcome.of(Status.EXPLORING) is Outcome.TIME_LIMIT
    assert [Outcome.of(s) for s in (Status.COMPLETE, Status.SEALED_IN, Status.STUCK)] == [
        Outcome.COMPLETE,
        Outcome.SEALED_IN,
        Outcome.STUCK,
    ]
    assert [outcome.exit_status for outcome in Outcome] == [0, 0, 3, 4, 5, 130]


def test_a_robot_that_squeezed_in_where_nothing_is_in_reach_hides_nothing_by_it(monkeypatch):
    building = BuildingConfig("apartment", seed=1)
    begun = run(prepare(ExperimentConfig(pose="truth", building=building, time_limit_s=0.5)))
    gaps = [UnknownLeft((0.0, 0.0), 50.0, Reason.TOO_NARROW, "beside all that is unexplored")]
    monkeypatch.setattr(World, "world_from_robot", property(lambda world: Pose2.identity()))  # in a corner
    assert not is_run_honest(replace(begun, outcome=Outcome.COMPLETE), gaps)
