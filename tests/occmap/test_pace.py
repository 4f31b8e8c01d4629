"""The explorer thinks again when it is time and something has been learnt, and not before."""

from __future__ import annotations

import math

import pytest

from occmap.pace import Pace, PaceConfig
from occmap.pursuit import LEARNT_M2

NEWS_M2 = 10.0 + LEARNT_M2


@pytest.fixture
def pace():
    """One that weighed goals at 20 s, when 10 m² were known."""
    pace = Pace(PaceConfig(first_look_s=0.5, reconsider_s=3.0, reconsider_nook_s=10.0))
    pace.weigh(10.0, 20.0)
    return pace


@pytest.mark.parametrize(
    ("known_m2", "now_s", "is_nook", "is_due"),
    [
        (NEWS_M2, 23.0, False, True),
        (NEWS_M2, 22.9, False, False),
        (10.2, 60.0, False, False),
        (NEWS_M2, 23.0, True, False),
        (NEWS_M2, 30.0, True, True),
    ],
)
def test_a_goal_is_weighed_now_and_then_if_something_was_learnt(pace, known_m2, now_s, is_nook, is_due):
    assert pace.is_due(known_m2, now_s, is_nook=is_nook) == is_due


def test_what_noise_took_back_is_not_learnt_twice(pace):
    pace.weigh(5.0, 30.0)
    assert not pace.is_due(10.0, 40.0, is_nook=False)


def test_another_map_is_news(pace):
    pace.forget_the_map()
    assert pace.is_due(10.0, 23.0, is_nook=False)


def test_the_first_look_begins_with_the_first_scan():
    pace = Pace(PaceConfig(first_look_s=0.5))
    pace.begin(7.0)
    pace.begin(7.4)
    assert pace.is_first_look(7.4)
    assert not pace.is_first_look(7.5)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="reconsider_s"):
        PaceConfig(reconsider_s=math.nan)
