"""A goal that leads nowhere is given up, unless the robot has seen something, or a gap is to blame."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.barred import TRIES, TRIES_WHERE_PASSED
from occmap.body import Body
from occmap.decision import Reason
from occmap.explorer_config import ExplorerConfig
from occmap.follower import Steering
from occmap.frontiers import Frontier
from occmap.geometry import Pose2, Twist2
from occmap.grid import Belief
from occmap.living_map import LivingMap
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.path import Path
from occmap.planner import Planner
from occmap.pursuit import Failure, Pursuit, PursuitConfig
from occmap.setbacks import Setbacks
from tests.ascii_maps import ascii_grid
from tests.occmap.goal_scenes import NO_MARGINS, goal_at

CONFIG = PursuitConfig(look_s=0.5, held_up_s=4.0, patience_s=10.0)
HERE = Pose2(1.0, 0.5, 0.0)
DOOR = """#######################
          #..........#..........#
          #.....................#
          #.....................#
          #.....................#
          #..........#..........#
          #######################"""
"""Cells of 0.1 m: the gap is 0.3 m wide."""


class Setting:
    """A map with a goal beyond a door, being driven to."""

    def __init__(self, *, is_tight=True):
        c = ExplorerConfig()
        self.map = LivingMap(c.grid, c.sensor_model, c.clearance, c.frontiers)
        self.map.replace(ascii_grid(DOOR, 0.1), Pose2.identity())
        self.looks = FailedLooks()
        self.looked_at = LookedAt()
        self.planner = Planner(NO_MARGINS, Body(radius_m=0.14))
        self.setbacks = Setbacks(CONFIG, self.planner, self.looks, self.looked_at)
        path = Path.through(np.array([[0.5, 0.35], [2.0, 0.35]]))
        self.pursuit = Pursuit(CONFIG, goal_at(2.0, 0.35), path, self.map.grid, 0.0, is_tight)

    def judge(self, now_s):
        return self.setbacks.judge(self.pursuit, HERE, self.map, now_s) or ""

    def comes_by(self, place):
        assert self.setbacks.judge(self.pursuit, place, self.map, 0.0) is None

    def failed(self):
        return [look.reason for look in self.looks._looks]


@pytest.fixture
def setting():
    return Setting()


def steering(*, arrived=False, held_up_s=0.0):
    return Steering(Twist2.zero(), 0.1, 0.0, arrived, held_up_s)


def test_while_nothing_is_wrong_nothing_happens(setting):
    setting.pursuit.advance(steering(), 1.0)
    assert not setting.judge(1.0)
    assert not setting.pursuit.is_over
    assert not setting.failed()


def test_a_look_in_vain_is_remembered(setting):
    setting.pursuit.advance(steering(arrived=True), 1.0)
    assert "in vain" in setting.judge(2.0)
    assert setting.pursuit.is_over
    assert setting.failed() == [Reason.GAVE_UP]


def test_a_look_that_showed_something_has_done_its_duty(setting):
    setting.map.grid.state[2:5, 15:20] = Belief.UNKNOWN
    setting.pursuit = Pursuit(
        CONFIG, setting.pursuit.goal, setting.pursuit.path, setting.map.grid, 0.0, is_tight=True
    )
    setting.map.grid.state[2:5, 15:20] = Belief.FREE
    setting.pursuit.advance(steering(arrived=True), 1.0)
    assert not setting.judge(2.0)
    assert setting.pursuit.is_over
    assert not setting.failed()


@pytest.mark.parametrize("arrived", [False, True])
def test_where_the_robot_has_stood_and_looked_counts_as_looked_at(setting, arrived):
    setting.pursuit.advance(steering(arrived=arrived), 1.0)
    setting.judge(2.0)
    edge = Frontier(np.array([[20, 3]]), (2.05, 0.35), 1)
    assert setting.looked_at.times(edge, setting.map.grid) == arrived


def test_a_gap_that_holds_the_robot_up_is_to_blame_and_not_the_goal(setting):
    setting.pursuit.advance(steering(held_up_s=5.0), 5.0)
    assert "the gap at (1.1" in setting.judge(5.0)
    assert setting.pursuit.is_void  # another way, then
    assert not setting.pursuit.is_over
    assert not setting.failed()


@pytest.mark.parametrize("correction", [None, Pose2(0.4, -0.2, 0.0)])
def test_a_gap_that_the_robot_came_through_is_not_closed_soon(setting, correction):
    """It would shut the robot in where it cannot stay: what let it in will let it out."""
    for x in np.arange(2.0, 0.9, -0.05):
        moved = Pose2(x, 0.35, math.pi)
        setting.comes_by(moved if correction is None else correction.inverse() @ moved)
    if correction is not None:
        setting.setbacks.carry_over(correction, 0.0)
    for k in range(TRIES_WHERE_PASSED):
        assert not len(setting.planner.barred.closed_cells(setting.map.grid))
        setting.pursuit.is_void = False
        setting.pursuit.advance(steering(held_up_s=5.0), 5.0 + k)
        assert "holds the robot up" in setting.judge(5.0 + k)
        assert setting.pursuit.is_void
    assert len(setting.planner.barred.closed_cells(setting.map.grid))
    assert not setting.failed()


def test_on_its_near_side_the_robot_has_not_come_through_a_gap(setting):
    for x in np.arange(0.3, 1.05, 0.05):
        setting.comes_by(Pose2(x, 0.35, 0.0))
    for k in range(TRIES):
        setting.pursuit.advance(steering(held_up_s=5.0), 5.0 + k)
        setting.judge(5.0 + k)
    assert len(setting.planner.barred.closed_cells(setting.map.grid))


def test_what_a_gap_kept_the_robot_from_is_not_worth_as_long_a_way_again(setting):
    setting.pursuit.advance(steering(held_up_s=5.0), 5.0)
    setting.judge(5.0)
    assert setting.looked_at.times(Frontier(np.array([[20, 3]]), (2.05, 0.35), 1), setting.map.grid) == 1


def test_where_no_gap_is_in_the_way_the_goal_is_unsafe():
    setting = Setting(is_tight=False)
    setting.pursuit.advance(steering(held_up_s=5.0), 5.0)
    assert "bars the way" in setting.judge(5.0)
    assert setting.pursuit.is_over
    assert setting.failed() == [Reason.UNSAFE]


def test_a_goal_turned_back_from_too_often_is_given_up(setting):
    grid = setting.map.grid
    events = [setting.setbacks.turn_back(setting.pursuit, grid, t) for t in (1.0, 2.0, 3.0)]
    assert events[:2] == [None, None]
    assert "turned back" in events[2]
    assert setting.failed() == [Reason.TOO_NARROW]


def test_giving_up_says_what_and_why(setting):
    event = setting.setbacks.give_up(
        setting.pursuit, Failure(Reason.UNSAFE, "the robot got stuck"), setting.map.grid, 1.0
    )
    assert event == f"gave up {setting.pursuit.goal}: the robot got stuck"
    assert setting.failed() == [Reason.UNSAFE]
