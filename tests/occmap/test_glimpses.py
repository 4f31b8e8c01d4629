"""What only a beam or two went through is told, though no frontier leads there."""

from __future__ import annotations

import numpy as np
import pytest

from occmap.glimpses import MOST_M, glimpses
from occmap.slices import finish
from tests.ascii_maps import ascii_grid

BEHIND_A_WINDOW = "\n".join(
    ["#" * 70, "#" * 20 + "?" * 49 + "#", *["#" + "." * 18 + "#" + "?" * 49 + "#"] * 10, "#" * 70]
)


@pytest.fixture
def grid():
    """0.9 m of free floor, a wall, and 2.4 m of unknown floor, in cells of 0.05 m."""
    return ascii_grid(BEHIND_A_WINDOW)


def test_where_no_beam_has_been_there_is_nothing_to_tell(grid):
    assert finish(glimpses(grid)) == []


def test_what_two_beams_went_through_is_told_piece_by_piece(grid):
    grid.log_odds[5, 25:65] = -0.8
    pieces = finish(glimpses(grid))
    assert len(pieces) == 2
    assert all(size_m <= MOST_M + 0.1 for _, size_m in pieces)
    np.testing.assert_allclose([place for place, _ in pieces], [(1.75, 0.275), (2.75, 0.275)])


def test_what_one_lost_echo_went_through_is_not(grid):
    grid.log_odds[5, 25:65] = -0.4
    assert finish(glimpses(grid)) == []


def test_what_is_no_longer_than_a_speck_is_not(grid):
    grid.log_odds[5, 25:31] = -0.8
    assert finish(glimpses(grid)) == []


def test_what_borders_on_free_cells_has_a_frontier_to_tell_of_it(grid):
    grid.log_odds[5, 25:65] = -0.8
    grid.state[5, 24] = 1
    assert finish(glimpses(grid)) == []
