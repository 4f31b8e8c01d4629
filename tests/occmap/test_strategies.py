"""What a goal is worth."""

from __future__ import annotations

import math

import pytest

from occmap.strategies import DECAY_PER_M, gain_decay, gain_per_cost, is_by_cost_alone, worth

NEAR_AND_SMALL, FAR_AND_LARGE = (1.0, 2.0), (12.0, 8.0)  # gain in m2, cost in m


@pytest.mark.parametrize(
    ("strategy", "prefers"),
    [("nearest", 0), ("tour", 0), ("utility", 1), ("gain_per_cost", 1), ("gain_decay", 1)],
)
def test_strategies_differ_in_what_they_prefer(strategy, prefers):
    values = [worth(strategy, *goal, 1.0) for goal in (NEAR_AND_SMALL, FAR_AND_LARGE)]
    assert values.index(max(values)) == prefers


def test_without_a_gain_the_nearest_is_best():
    assert worth("nearest", math.nan, 3.0, 1.0) == -3.0
    assert is_by_cost_alone("nearest")
    assert not is_by_cost_alone("gain_decay")


def test_a_gain_fades_with_the_way():
    assert gain_decay(5.0, 0.0) == 5.0
    assert gain_decay(5.0, 1.0 / DECAY_PER_M) == pytest.approx(5.0 / math.e)


def test_a_goal_underfoot_is_not_worth_infinitely_much():
    assert gain_per_cost(2.0, 0.0) == gain_per_cost(2.0, 0.5) == 4.0


@pytest.mark.parametrize("strategy", ["nearest", "utility", "gain_per_cost", "gain_decay"])
def test_no_goal_gets_better_by_being_farther(strategy):
    values = [worth(strategy, 3.0, cost, 1.0) for cost in (0.0, 0.4, 1.0, 5.0, 20.0)]
    assert values == sorted(values, reverse=True)
