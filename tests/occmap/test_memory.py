"""What is remembered, when it is forgotten, and how it survives a correction of the map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from occmap.decision import Reason
from occmap.frontiers import Frontier
from occmap.geometry import Pose2
from occmap.grid import Belief
from occmap.memory import CUT_OFF_M2, FailedLooks, ReachMemory
from occmap.reach_kernels import carry
from tests.ascii_maps import ascii_grid, grid_of
from tests.occmap.goal_scenes import Scene, goal_at


def frontier_of(grid, *cells):
    places = grid.frame.map_from_cell(np.array(cells))
    return Frontier(np.array(cells), (float(places[:, 0].mean()), float(places[:, 1].mean())), len(cells))


@pytest.fixture
def hall():
    """10 m x 10 m of free floor in cells of 0.1 m."""
    return grid_of(np.full((100, 100), Belief.FREE, np.uint8), 0.1)


def noted(looks, grid, x_m, y_m, reason=Reason.GAVE_UP):
    looks.note(goal_at(x_m, y_m), reason, "in vain", grid)


def test_a_failed_look_counts_for_frontiers_near_by(hall):
    looks = FailedLooks()
    noted(looks, hall, 5.0, 5.0)
    noted(looks, hall, 5.2, 5.0, Reason.UNSAFE)
    here, there = frontier_of(hall, (50, 52), (51, 52), (52, 52)), frontier_of(hall, (60, 50))
    assert [look.reason for look in looks.at(here, hall)] == [Reason.GAVE_UP, Reason.UNSAFE]
    assert looks.at(there, hall) == []


def test_the_same_frontier_is_known_again_whatever_its_shape(hall):
    """Of a horseshoe no cell is nearest to the middle: noise alone tells which."""
    looks = FailedLooks()
    horseshoe = [*((40, y) for y in range(40, 60)), *((60, y) for y in range(40, 60))]
    places = hall.frame.map_from_cell(np.array(horseshoe))
    looks.note(replace(goal_at(5.05, 5.0), watched_in_map=places), Reason.GAVE_UP, "in vain", hall)
    assert looks.at(frontier_of(hall, *horseshoe[:-1]), hall)
    assert looks.at(frontier_of(hall, *horseshoe[1:]), hall)
    assert not looks.at(frontier_of(hall, *horseshoe[:20]), hall)


def test_what_is_behind_a_wall_is_another_frontier(hall):
    looks = FailedLooks()
    noted(looks, hall, 5.0, 5.0)
    other_side = frontier_of(hall, (53, 50))
    assert looks.at(other_side, hall)
    hall.state[:, 51] = Belief.OCCUPIED
    assert not looks.at(other_side, hall)


@pytest.mark.parametrize("now", [Belief.UNKNOWN, Belief.FREE])
def test_a_failed_look_is_forgotten_when_the_map_near_it_changes(hall, now):
    """Whether more has become known or less."""
    hall.state[40:60, 40:60][:, ::2] = Belief.FREE if now == Belief.UNKNOWN else Belief.UNKNOWN
    hall.state[50, 50] = Belief.FREE
    looks, frontier = FailedLooks(), frontier_of(hall, (50, 50))
    noted(looks, hall, 5.05, 5.05)
    hall.state[70:, :] = Belief.UNKNOWN  # far away
    assert looks.at(frontier, hall)
    hall.state[42:43, 40:60] = now  # 20 of 400 cells at most
    assert looks.at(frontier, hall)
    hall.state[40:46, 40:60] = now
    assert not looks.at(frontier, hall)


def test_failed_looks_follow_a_correction_of_the_map(hall):
    looks = FailedLooks()
    noted(looks, hall, 5.0, 5.0)
    looks.carry_over(Pose2(3.0, 0.0, math.pi / 2))  # (5, 5) comes to (-2, 5), outside
    assert not looks.at(frontier_of(hall, (50, 50)), hall)
    looks.carry_over(Pose2(4.0, 0.0, 0.0))
    assert looks.at(frontier_of(hall, (20, 50)), hall)


TWO_ROOMS = """#####################
               #.........#.........#
               #.........#.........#
               #...................#
               #...................#
               #.........#.........#
               #.........#.........#
               #####################"""


class Reaching(Scene):
    def __init__(self, picture):
        super().__init__(picture, start=(3, 3))
        self.reach = ReachMemory()
        self.reach.note(self.flood(), self.grid)

    def is_cut_off(self):
        self.clearance.rebuild(self.grid)
        roomy = self.planner.traversable(self.grid, self.clearance.distance_m)
        return self.reach.is_cut_off(self.flood(), self.grid, roomy)


def test_a_door_that_closes_cuts_off_what_was_in_reach():
    scene = Reaching(TWO_ROOMS)
    assert not scene.is_cut_off()
    scene.grid.state[:, 10] = Belief.OCCUPIED
    assert scene.is_cut_off()


def test_what_never_was_in_reach_is_not_missed():
    scene = Reaching(TWO_ROOMS.replace("#...................#", "#.........#.........#"))
    assert not scene.is_cut_off()


def test_what_became_an_obstacle_or_is_tiny_is_not_missed():
    scene = Reaching(TWO_ROOMS)
    scene.grid.state[:, 10:18] = Belief.OCCUPIED  # a strip of 2 cells by 6 stays: 0.75 m2
    assert scene.is_cut_off()
    scene.grid.state[:, 10:19] = Belief.OCCUPIED  # 0.375 m2
    assert CUT_OFF_M2 > 6 * 0.25**2
    assert not scene.is_cut_off()


def test_reach_is_remembered_while_the_grid_grows():
    scene = Reaching(TWO_ROOMS)
    scene.grid.grow_to_contain((-3.0, -3.0), (9.0, 9.0))
    dx, dy = -scene.grid.offset[0], -scene.grid.offset[1]
    scene.start = (3 + dx, 3 + dy)
    scene.grid.state[:, 10 + dx] = Belief.OCCUPIED
    assert scene.is_cut_off()


def test_reach_follows_a_correction_of_the_map():
    """The same rooms, turned by a quarter, in a grid with another origin."""
    scene = Reaching(TWO_ROOMS)
    turned = ascii_grid(TWO_ROOMS, 0.25)
    turned.state = np.ascontiguousarray(np.rot90(turned.state, -1))  # a picture turned to the left, y up
    turned.log_odds = np.ascontiguousarray(np.rot90(turned.log_odds, -1))
    turned.offset = (-8, 0)
    turned._set_frame()
    quarter = Pose2(0.0, 0.0, math.pi / 2)
    assert turned.frame.cell_from_map(quarter.apply(np.array([[0.9, 0.6]]))).tolist() == [[5, 3]]
    scene.reach.carry_over(quarter, turned)
    scene.grid, scene.start = turned, (5, 3)
    assert not scene.is_cut_off()
    scene.grid.state[10, :] = Belief.OCCUPIED
    assert scene.is_cut_off()


@pytest.mark.parametrize("yaw_rad", [0.0, 0.02, -2.0])
def test_what_was_in_reach_comes_to_lie_where_its_cells_are_moved_to(yaw_rad):
    rng = np.random.default_rng(4)
    reached = (rng.random((40, 60)) < 0.3).astype(np.uint8)
    carried, expected = np.zeros((50, 50), np.uint8), np.zeros((50, 50), np.uint8)
    iy, ix = np.nonzero(reached)
    x, y = np.floor(Pose2(12.3, 7.6, yaw_rad).apply(np.column_stack((ix, iy)).astype(float))).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < 50) & (y < 50)
    expected[y[inside], x[inside]] = 1
    carry(reached, carried, math.cos(yaw_rad), math.sin(yaw_rad), 12.3, 7.6)
    assert expected.any()
    np.testing.assert_array_equal(carried, expected)


def test_a_look_at_several_frontiers_fails_at_each_of_them(hall):
    looks = FailedLooks()
    both = goal_at(2.05, 5.05, also_watched_in_map=(np.array([[8.05, 5.05]]),))
    looks.note(both, Reason.GAVE_UP, "in vain", hall)
    for ix, failed in ((20, 1), (50, 0), (80, 1)):
        assert len(looks.at(frontier_of(hall, (ix, 50)), hall)) == failed
