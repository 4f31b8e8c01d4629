"""The table of the benchmark."""

from typing import get_args

from experiments.benchmark import PARTS, Part, ratio
from experiments.benchmark_figure import Figure


def test_every_part_can_be_measured():
    assert tuple(PARTS) == get_args(Part)


def test_a_figure_that_this_machine_cannot_give_is_a_dash():
    assert str(Figure("C", None, "us", "70")).split() == ["C", "-", "us", "70"]
    assert "0.123" in str(Figure("share", 0.12345, ""))
    assert ratio(3.0, None) is None
    assert ratio(3.0, 2.0) == 1.5
