"""The goal of the moment: its path holds until the map or a better goal says otherwise."""

from __future__ import annotations

import pytest

from occmap.body import Body
from occmap.decision import Reason
from occmap.explorer_config import ExplorerConfig
from occmap.follower import Follower
from occmap.geometry import Pose2
from occmap.goal_search import GoalSearch
from occmap.goals import GoalChooser
from occmap.living_map import LivingMap
from occmap.memory import FailedLooks
from occmap.navigator import Navigator
from occmap.planner import Planner
from occmap.pursuit import Failure
from tests.ascii_maps import ascii_grid
from tests.occmap.goal_scenes import NO_MARGINS, goal_at

BODY = Body(radius_m=0.04)
HERE = Pose2(0.5, 0.35, 0.0)
DOORS = """#######################
           #..........#..........#
           #.....................#
           #..........#..........#
           #..........#..........#
           #.....................#
           #..........#..........#
           #######################"""
"""Cells of 0.1 m; no frontier anywhere."""
EAST, NORTH = (2.05, 0.25), (0.55, 0.55)


class Setting:
    """A robot in a drawn map, and the navigator that is to take it somewhere."""

    def __init__(self):
        c = ExplorerConfig()
        self.map = LivingMap(c.grid, c.sensor_model, c.clearance, c.frontiers)
        self.map.replace(ascii_grid(DOORS, 0.1), Pose2.identity())
        self.search = GoalSearch(GoalChooser(c.goals), FailedLooks())
        self.planner = Planner(NO_MARGINS, BODY)
        self.events = []
        follower = Follower(c.follower, BODY)
        self.navigator = Navigator(c.pursuit, self.planner, follower, self.map, self.search, self.events)

    def set_out(self, place, now_s=0.0):
        cell = self.map.grid.frame.cell_at(*HERE.position)
        wave = self.planner.flood(self.map.grid, self.map.clearance_m, cell)
        self.navigator.set_out(goal_at(*place), wave, now_s)
        return self.navigator.pursuit

    def close_the_doors(self):
        closed = DOORS.replace("#.....................#", "#..........#..........#")
        self.map.replace(ascii_grid(closed, 0.1), HERE)


@pytest.fixture
def setting():
    return Setting()


def test_before_there_is_a_goal_there_is_no_way(setting):
    navigator = setting.navigator
    assert (navigator.goal, navigator.way_left_m, navigator.is_blocked) == (None, 0.0, False)


def test_a_goal_that_is_chosen_again_is_driven_to_on_the_same_path(setting):
    path = setting.set_out(EAST).path
    assert path.goal == pytest.approx(EAST, abs=0.05)
    assert setting.navigator.way_left_m == pytest.approx(path.length_m)
    again = setting.set_out((EAST[0] - 0.1, EAST[1]))
    assert again.path is path
    assert again.goal.viewpoint_in_map == (EAST[0] - 0.1, EAST[1])
    assert (setting.navigator.replans, setting.navigator.goal_switches) == (1, 0)
    assert len(setting.events) == 1


def test_another_goal_is_another_path_and_a_switch(setting):
    setting.set_out(EAST)
    assert setting.set_out(NORTH).path.goal == pytest.approx(NORTH, abs=0.05)
    assert (setting.navigator.replans, setting.navigator.goal_switches) == (2, 1)


def test_a_goal_left_again_and_again_with_nothing_learnt_is_given_up(setting):
    for _ in range(setting.navigator.config.turns_back):
        setting.set_out(EAST)
        setting.set_out(NORTH)
        setting.navigator.break_off()
    (look,) = setting.search.looks._looks
    assert look.reason is Reason.GAVE_UP
    assert any("turned back" in event for event in setting.events)


def test_where_the_map_bars_the_path_it_is_blocked(setting):
    setting.set_out(EAST)
    setting.close_the_doors()
    assert setting.navigator.is_blocked
    assert setting.navigator.way_left_m == 0.0


def test_a_correction_of_the_map_voids_the_path_but_not_the_goal(setting):
    setting.set_out(EAST)
    setting.navigator.carry_over(Pose2(0.1, 0.0, 0.0))
    assert setting.navigator.goal.viewpoint_in_map == pytest.approx((EAST[0] + 0.1, EAST[1]))
    assert setting.navigator.way_left_m == 0.0
    setting.set_out((EAST[0] + 0.1, EAST[1]))
    assert (setting.navigator.replans, setting.navigator.goal_switches) == (2, 0)


def test_a_goal_whose_frontier_is_gone_is_dropped_as_looked_at(setting):
    setting.set_out(EAST)
    setting.navigator.drop_what_is_gone()
    assert setting.navigator.goal is None
    assert len(setting.search.looked_at._looks) == 1
    assert not setting.search.looks._looks


def test_what_is_given_up_is_remembered_and_what_is_broken_off_is_not(setting):
    setting.set_out(EAST)
    setting.navigator.break_off()
    assert (setting.navigator.goal, list(setting.search.looks._looks)) == (None, [])
    setting.set_out(EAST)
    setting.navigator.give_up(Failure(Reason.UNSAFE, "stuck"), 1.0)
    assert setting.navigator.goal is None
    assert [look.reason for look in setting.search.looks._looks] == [Reason.UNSAFE]
    assert "stuck" in setting.events[-1]
