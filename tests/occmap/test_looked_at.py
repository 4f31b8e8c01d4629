"""Looks that were had: where they count, and when they are forgotten."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.grid import Belief
from occmap.looked_at import LookedAt
from tests.ascii_maps import grid_of
from tests.occmap.goal_scenes import goal_at
from tests.occmap.test_memory import frontier_of


@pytest.fixture
def hall():
    """10 m x 10 m of free floor in cells of 0.1 m."""
    return grid_of(np.full((100, 100), Belief.FREE, np.uint8), 0.1)


def test_looks_count_for_what_is_left_near_by(hall):
    looked_at = LookedAt()
    assert looked_at.times(frontier_of(hall, (50, 50)), hall) == 0
    looked_at.note(goal_at(5.0, 5.0), hall)
    looked_at.note(goal_at(5.4, 5.0), hall)
    assert looked_at.times(frontier_of(hall, (50, 57), (51, 57)), hall) == 2
    assert looked_at.times(frontier_of(hall, (62, 50)), hall) == 1
    assert looked_at.times(frontier_of(hall, (70, 50)), hall) == 0


def test_a_look_at_several_frontiers_counts_for_each(hall):
    looked_at = LookedAt()
    looked_at.note(goal_at(5.0, 5.0, also_watched_in_map=(np.array([[2.0, 2.0]]),)), hall)
    assert looked_at.times(frontier_of(hall, (20, 20)), hall) == 1


def test_a_nook_near_a_frontier_that_was_looked_into_is_another_matter(hall):
    looked_at, edge = LookedAt(), frontier_of(hall, (50, 50))
    looked_at.note(goal_at(5.0, 5.0), hall)
    assert looked_at.times(edge, hall, is_nook=True) == 0
    looked_at.note(goal_at(5.0, 5.0, is_nook=True), hall)
    assert looked_at.times(edge, hall, is_nook=True) == 1


def test_what_is_behind_a_wall_was_not_looked_into(hall):
    looked_at, other_side = LookedAt(), frontier_of(hall, (53, 50))
    looked_at.note(goal_at(5.0, 5.0), hall)
    hall.state[:, 51] = Belief.OCCUPIED
    assert looked_at.times(other_side, hall) == 0


def test_cells_that_come_and_go_do_not_make_it_new_but_a_change_of_the_map_does(hall):
    looked_at, frontier = LookedAt(), frontier_of(hall, (50, 50))
    looked_at.note(goal_at(5.05, 5.05), hall)
    hall.state[42, 40:60] = Belief.UNKNOWN  # 20 of 400 cells
    assert looked_at.times(frontier, hall) == 1
    hall.state[42:46, 40:60] = Belief.UNKNOWN
    assert looked_at.times(frontier, hall) == 0


def test_looks_follow_a_correction_of_the_map(hall):
    looked_at = LookedAt()
    looked_at.note(goal_at(5.0, 5.0), hall)
    looked_at.carry_over(Pose2(7.0, 0.0, math.pi / 2))  # (5, 5) comes to (2, 5)
    assert looked_at.times(frontier_of(hall, (20, 50)), hall) == 1
    assert looked_at.times(frontier_of(hall, (50, 50)), hall) == 0


def far_trip(looked_at, grid, shown_rows, *, is_far=True):
    """To a frontier around which so many rows of 20 cells of 0.1 m are known afterwards, and were not."""
    goal = goal_at(5.05, 5.05)
    grid.state[40:60, 40:60] = Belief.UNKNOWN
    looked_at.set_out(goal, grid, is_far=is_far)
    grid.state[40 : 40 + shown_rows, 40:60] = Belief.FREE
    looked_at.note(goal, grid)


def test_far_looks_in_vain_are_counted_until_one_shows_something(hall):
    looked_at = LookedAt()
    far_trip(looked_at, hall, 0)
    far_trip(looked_at, hall, 0, is_far=False)
    far_trip(looked_at, hall, 0)
    assert looked_at.in_vain == 2
    far_trip(looked_at, hall, 2)
    assert looked_at.in_vain == 0


def test_a_trip_that_another_goal_cut_short_says_nothing(hall):
    looked_at = LookedAt()
    looked_at.set_out(goal_at(5.0, 5.0), hall, is_far=True)
    looked_at.set_out(goal_at(2.0, 2.0), hall, is_far=False)
    looked_at.note(goal_at(2.0, 2.0), hall)
    assert looked_at.in_vain == 0
