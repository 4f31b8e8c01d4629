"""Trajectory errors on paths whose error is known."""

import numpy as np
import pytest

from experiments.trajectory import absolute_error_m, drift_per_m


def straight(n: int, step_m: float) -> np.ndarray:
    return np.column_stack((np.arange(n) * step_m, np.zeros(n), np.zeros(n)))


def test_a_perfect_estimate_has_no_error():
    path = straight(50, 0.1)
    assert absolute_error_m(path, path) == 0.0
    assert drift_per_m(path, path) == 0.0


def test_a_constant_offset_is_all_absolute_and_no_drift():
    path, offset = straight(50, 0.1), np.array([0.3, 0.4, 0.0])
    assert absolute_error_m(path, path + offset) == pytest.approx(0.5)
    assert drift_per_m(path, path + offset) == pytest.approx(0.0, abs=1e-12)


def test_wheels_two_percent_too_large_drift_two_centimetres_a_metre():
    assert drift_per_m(straight(50, 0.1), straight(50, 0.102)) == pytest.approx(0.02)


def test_drift_does_not_depend_on_where_the_path_lies():
    turned = straight(50, 0.1)[:, [1, 0, 2]] + np.array([0.0, 0.0, np.pi / 2])
    believed = straight(50, 0.102)[:, [1, 0, 2]] + np.array([0.0, 0.0, np.pi / 2])
    assert drift_per_m(turned, believed) == pytest.approx(0.02)


def test_a_path_shorter_than_a_metre_has_no_drift_to_speak_of():
    assert drift_per_m(straight(5, 0.1), straight(5, 0.2)) == 0.0
