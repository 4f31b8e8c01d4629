"""The end comes when no goal has turned up for a while, and not before."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.decision import Status
from occmap.ending import Ending, EndingConfig
from tests.occmap.goal_scenes import Scene

ROOMS = """#####################
           #.........#.........#
           #.........#.........#
           #...................#
           #...................#
           #.........#.........#
           #.........#.........#
           #####################"""


class Closing(Scene):
    """Two rooms, and an ending that watches over them."""

    def __init__(self):
        super().__init__(ROOMS, start=(3, 3))
        self.ending = Ending(EndingConfig(confirm_s=1.0, survey_s=10.0))

    def status_at(self, now_s, has_goal=False):
        self.clearance.rebuild(self.grid)
        wave = self.flood()
        self.ending.note(has_goal, wave, self.grid, now_s)
        roomy = self.planner.traversable(self.grid, self.clearance.distance_m)
        return self.ending.status(wave, self.grid, roomy, now_s)


def test_it_waits_for_a_goal_to_turn_up():
    rooms = Closing()
    assert rooms.status_at(5.0) is Status.EXPLORING
    assert rooms.status_at(5.9) is Status.EXPLORING
    assert rooms.status_at(6.0) is Status.COMPLETE


def test_while_there_is_no_goal_one_is_sought_now_and_then():
    rooms = Closing()
    assert rooms.ending.is_search_due(5.0)
    rooms.status_at(5.0)
    assert not rooms.ending.is_search_due(5.4)
    assert rooms.ending.is_search_due(5.5)
    rooms.status_at(5.5, has_goal=True)
    assert rooms.ending.is_search_due(5.6)


def test_a_goal_that_turns_up_starts_the_wait_afresh():
    rooms = Closing()
    rooms.status_at(5.0)
    assert rooms.status_at(5.9, has_goal=True) is Status.EXPLORING
    assert rooms.status_at(6.5) is Status.EXPLORING
    assert rooms.status_at(7.5) is Status.COMPLETE


def test_a_part_shut_off_meanwhile_means_sealed_in():
    rooms = Closing()
    rooms.status_at(5.0, has_goal=True)
    rooms.grid.state[:, 10] = 2
    rooms.status_at(6.0)
    assert rooms.status_at(7.0) is Status.SEALED_IN


def test_surveys_are_due_now_and_then():
    rooms, due = Closing(), []
    for now_s in 0.1 * np.arange(300):
        if rooms.ending.is_survey_due(now_s):
            due.append(now_s)
            rooms.ending.survey(rooms.flood(), rooms.grid, now_s)
    assert due == pytest.approx([0.0, 10.0, 20.0], abs=0.11)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="confirm_s"):
        EndingConfig(confirm_s=math.nan)
