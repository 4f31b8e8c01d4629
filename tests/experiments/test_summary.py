"""The parts of a summary that need no run."""

import math
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from experiments.curves import milestone
from experiments.summary_parts import finite, map_sha256
from occmap.grid import Belief, OccupancyGrid


def samples(*rows: tuple[float, float, float]) -> list:
    """(explored, metres, seconds) each."""
    return [SimpleNamespace(score=SimpleNamespace(explored=e), path_length_m=m, time_s=s) for e, m, s in rows]


def test_a_milestone_lies_between_the_samples_around_it():
    curve = samples((0.1, 0.0, 0.0), (0.4, 3.0, 10.0), (0.6, 5.0, 20.0))
    assert milestone(curve, 0.5) == {"metres": pytest.approx(4.0), "seconds": pytest.approx(15.0)}


def test_a_milestone_passed_at_the_start_took_nothing():
    assert milestone(samples((0.7, 0.0, 0.0), (0.8, 1.0, 2.0)), 0.5) == {"metres": 0.0, "seconds": 0.0}


def test_a_milestone_never_passed_is_none():
    assert milestone(samples((0.1, 0.0, 0.0), (0.4, 3.0, 10.0)), 0.5) is None


def test_a_milestone_counts_when_it_is_passed_first():
    curve = samples((0.0, 0.0, 0.0), (0.6, 1.0, 1.0), (0.4, 2.0, 2.0), (0.6, 3.0, 3.0))
    assert milestone(curve, 0.6) == {"metres": 1.0, "seconds": 1.0}


def test_json_gets_no_number_that_is_none():
    assert finite({"a": [math.nan, 1.0], "b": math.inf, "c": "x"}) == {"a": [None, 1.0], "b": None, "c": "x"}


def test_the_fingerprint_sees_every_cell_and_where_it_lies():
    def grid(shift: float, cell: Belief) -> OccupancyGrid:
        made = OccupancyGrid()
        made.grow_to_contain((shift, 0.0), (shift + 1.0, 1.0))
        made.state[3, 4] = cell
        return made

    prints = {map_sha256(grid(s, c)) for s in (0.0, 0.5) for c in (Belief.FREE, Belief.OCCUPIED)}
    assert len(prints) == 4
    assert map_sha256(grid(0.0, Belief.FREE)) == map_sha256(grid(0.0, Belief.FREE))
    assert np.all([len(p) == 64 for p in prints])


def test_memory_is_a_process_s_own_not_its_parent_s():
    large_mb = 800
    held = np.ones(large_mb << 17)
    told = "from experiments.summary_parts import peak_memory_mb as own; print(own())"
    child = subprocess.run([sys.executable, "-c", told], check=True, capture_output=True, text=True)
    assert 10.0 < float(child.stdout) < held.nbytes / 2**20
