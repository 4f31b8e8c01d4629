"""Time goes on, whatever the stamps do."""

from __future__ import annotations

import numpy as np
import pytest

from occmap.steady_clock import SteadyClock

PERIOD_S = 0.1


def read(*stamps_s: float) -> list[float]:
    clock = SteadyClock(PERIOD_S)
    return [clock.read(stamp_s) for stamp_s in stamps_s]


def test_stamps_that_go_on_are_taken_as_they_are():
    stamps_s = [1.7e9, 1.7e9 + 0.04, 1.7e9 + 0.3, 1.7e9 + 60.0]
    assert read(*stamps_s) == stamps_s


def test_a_clock_that_is_set_back_goes_on_where_it_was():
    assert read(5.0, 5.1, 0.0, 0.1, -7.0, -6.8) == pytest.approx([5.0, 5.1, 5.2, 5.3, 5.4, 5.6])


def test_a_clock_that_stands_ticks_once_a_period():
    assert read(0.0, 0.0, 0.0, 0.0) == pytest.approx([0.0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize("begun_s", [0.0, 0.03, 0.1 - 1e-9, 1.7e9])
def test_coarse_stamps_are_read_as_ticks_of_a_period(begun_s):
    """No two of them so close that whatever moved in between would seem to have leapt."""
    true_s = begun_s + np.cumsum(np.full(200, PERIOD_S))
    times_s = np.array(read(*np.floor(true_s).tolist()))
    assert np.diff(times_s).min() > 0.4 * PERIOD_S
    assert np.abs(times_s - true_s).max() < 1.0 + PERIOD_S


def test_time_stands_at_no_stamp():
    stamps_s = np.random.default_rng(0).integers(0, 3, 200).astype(float).tolist()
    assert np.all(np.diff(read(*stamps_s)) > 0.0)
