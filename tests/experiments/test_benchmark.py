"""The table of the benchmark."""

from typing import get_args

import numpy as np

from experiments.benchmark import PARTS, Part
from experiments.benchmarking.figure import Figure, compared, ratio
from experiments.benchmarking.rivals import (
    clearance_rivals,
    frontier_rivals,
    integrate_by_arrays,
    milliseconds,
)


def test_every_part_can_be_measured():
    assert tuple(PARTS) == get_args(Part)


def test_a_figure_that_this_machine_cannot_give_is_a_dash():
    assert str(Figure("C", None, "us", "70")).split() == ["C", "-", "us", "70"]
    assert "0.123" in str(Figure("share", 0.12345, ""))
    assert ratio(3.0, None) is None
    assert ratio(3.0, 2.0) == 1.5


def test_a_library_that_is_not_there_is_said_not_to_be_installed():
    there, missing = compared(2.0, {"one": 6.0, "other": None})
    assert str(there).split() == ["one", "3", "x", "ours"]
    assert str(missing).split() == ["other", "not", "installed", "x", "ours"]


def test_rivals_that_are_installed_are_timed():
    state = np.random.default_rng(0).integers(0, 3, (50, 60)).astype(np.uint8)
    for rivals in (frontier_rivals(state), clearance_rivals(state)):
        spent = milliseconds(rivals, repeats=1)
        assert {name for name, job in rivals.items() if job is None} == {
            name for name, ms in spent.items() if ms is None
        }
        assert any(name.startswith(("scipy", "NumPy")) and ms is not None for name, ms in spent.items())


def test_the_array_twin_spends_a_scan_as_the_loop_does():
    """But for cells in which a beam's line meets a corner: they lie on either side of it."""
    rng = np.random.default_rng(1)
    ends = np.vstack(([[50, 50]], rng.integers(5, 95, (40, 2)))).astype(np.int32)
    hit = rng.integers(0, 2, 40).astype(np.uint8)
    log_odds = np.zeros((100, 100), np.float32)
    integrate_by_arrays(log_odds, ends, hit, 0.85, -0.4, 100.0)
    cells_crossed = np.abs(ends[1:] - ends[0]).max(axis=1).sum()
    votes = 0.85 * hit.sum() - 0.4 * (cells_crossed + (1 - hit).sum())
    np.testing.assert_allclose(log_odds.sum(), votes, rtol=1e-4)
