"""The inverse sensor model, as a function of distance and as numbers."""

from __future__ import annotations

import math

import pytest

from occmap.sensor_model import SensorModelConfig, inverse_sensor_model


@pytest.mark.parametrize(("r_m", "says"), [(1.5, 0.3), (2.95, 0.7), (3.05, 0.7), (4.0, 0.5)])
def test_lesson_beam_of_3_m(r_m: float, says: float):
    assert inverse_sensor_model(r_m, 3.0, 12.0, alpha_m=0.10) == says


@pytest.mark.parametrize("r_m", [0.0, 6.0, 11.99])
def test_a_beam_that_met_nothing_frees_its_whole_length(r_m: float):
    assert inverse_sensor_model(r_m, math.inf, 12.0) == 0.3
    assert inverse_sensor_model(r_m, 12.0, 12.0) == 0.3


def test_a_beam_that_met_nothing_says_nothing_beyond_its_reach():
    assert inverse_sensor_model(12.5, math.inf, 12.0) == 0.5


def test_default_increments_are_the_lessons():
    assert SensorModelConfig().increments() == (0.85, -0.40)


def test_increments_follow_the_probabilities_when_given():
    hit, miss = SensorModelConfig(p_occupied=0.7, p_free=0.3).increments()
    assert hit == pytest.approx(math.log(7 / 3))
    assert miss == pytest.approx(-math.log(7 / 3))
    hit, miss = SensorModelConfig(p_occupied=0.7, p_free=0.3).increments(prior=0.4)
    assert hit == pytest.approx(math.log(7 / 3) - math.log(2 / 3))
    assert miss == pytest.approx(-math.log(7 / 3) - math.log(2 / 3))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("hit_log_odds", -0.85),
        ("hit_log_odds", math.nan),
        ("miss_log_odds", 0.4),
        ("p_occupied", 0.3),
        ("p_free", 0.7),
        ("obstacle_thickness_m", -0.1),
        ("beam_width_rad", 2.0),
        ("usable_range_m", 0.0),
        ("usable_range_m", math.nan),
    ],
)
def test_nonsense_is_refused_by_name(field: str, value: float):
    with pytest.raises(ValueError, match=field):
        SensorModelConfig(**{field: value})


def test_probabilities_on_one_side_of_the_prior_are_refused():
    with pytest.raises(ValueError, match="either side of the prior"):
        SensorModelConfig(p_occupied=0.6).increments(prior=0.65)
