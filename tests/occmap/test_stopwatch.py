"""The stopwatch adds up what it is told."""

import pytest

from occmap.stopwatch import Stopwatch


def test_laps_add_up_by_stage():
    watch = Stopwatch()
    watch.add({"mapping": 0.25, "planning": 0.5})
    watch.add({"mapping": 0.25})
    assert watch.total_s("mapping") == 0.5
    assert watch.total_s("planning") == 0.5
    assert watch.total_s("never") == 0.0


def test_a_lap_counts_even_if_the_block_raises():
    watch = Stopwatch()
    with pytest.raises(RuntimeError), watch.lap("physics"):
        raise RuntimeError
    assert len(watch.laps_s["physics"]) == 1
