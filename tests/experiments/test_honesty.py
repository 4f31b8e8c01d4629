"""When a run may say that it is done."""

import numpy as np
import pytest

from experiments.honesty import is_honest
from experiments.outcome import Outcome
from occmap.decision import Reason, Status, UnknownLeft
from occmap.geometry import Pose2
from sim.truth import TruthGrid

TRUTH = TruthGrid(0.1, (0.0, 0.0), np.zeros((30, 30), bool))
START = Pose2(1.0, 1.0, 0.0)


def hole(cells: int) -> np.ndarray:
    """A row of unexplored cells from (2.0, 2.0) on."""
    unexplored = np.zeros((30, 30), bool)
    unexplored[20, 20 : 20 + cells] = True
    return unexplored


def left(x_in_map: float, y_in_map: float, reason: Reason) -> UnknownLeft:
    return UnknownLeft((x_in_map, y_in_map), 0.2, reason, "")


@pytest.mark.parametrize("outcome", [Outcome.COMPLETE, Outcome.SEALED_IN])
def test_saying_done_is_honest_if_no_more_than_a_footprint_is_left(outcome):
    assert is_honest(outcome, hole(9), [], TRUTH, START)
    assert not is_honest(outcome, hole(10), [], TRUTH, START)


@pytest.mark.parametrize("outcome", [Outcome.TIME_LIMIT, Outcome.STUCK, Outcome.INTERRUPTED])
def test_a_run_that_ended_early_may_leave_anything(outcome):
    assert is_honest(outcome, hole(10), [], TRUTH, START)


@pytest.mark.parametrize("reason", [Reason.GAVE_UP, Reason.UNSAFE])
def test_nothing_given_up_may_hide_explorable_area(reason):
    # in the world the frontier lies at (2.0, 2.0), beside the hole
    assert not is_honest(Outcome.COMPLETE, hole(5), [left(1.0, 1.0, reason)], TRUTH, START)
    assert not is_honest(Outcome.TIME_LIMIT, hole(5), [left(1.0, 1.0, reason)], TRUTH, START)
    assert is_honest(Outcome.COMPLETE, hole(5), [left(0.0, 1.0, reason)], TRUTH, START)  # elsewhere
    assert is_honest(Outcome.COMPLETE, hole(4), [left(1.0, 1.0, reason)], TRUTH, START)  # a speck


def test_a_gap_that_is_too_narrow_hides_nothing_that_counts():
    assert is_honest(Outcome.COMPLETE, hole(5), [left(1.0, 1.0, Reason.TOO_NARROW)], TRUTH, START)


def test_the_explorers_last_word_becomes_the_outcome():
    assert Outcome.of(Status.EXPLORING) is Outcome.TIME_LIMIT
    assert [Outcome.of(s) for s in (Status.COMPLETE, Status.SEALED_IN, Status.STUCK)] == [
        Outcome.COMPLETE,
        Outcome.SEALED_IN,
        Outcome.STUCK,
    ]
    assert [outcome.exit_status for outcome in Outcome] == [0, 0, 3, 4, 5, 130]
