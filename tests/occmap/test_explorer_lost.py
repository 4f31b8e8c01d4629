"""A robot that does not know where it is: it stands, maps nothing, and never calls itself done."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from occmap.decision import Status
from occmap.geometry import Twist2
from occmap.localization import SlamLocalizer
from occmap.localization.localizer import OdometryLocalizer
from occmap.localization.map_localizer import MapLocalizer
from tests.occmap.explored_worlds import CELL, FLAT, exploring

ELSEWHERE = """###############
               #.#...#...#...#
               #......#.#..#.#
               #.#.#.........#
               #....#.@.#..#.#
               #.#.........#.#
               #...#..#..#...#
               ###############"""
"""Nowhere in the flat are there so many pillars."""


class Losing(OdometryLocalizer):
    """Believes the wheels, but for some seconds says that it does not know."""

    def __init__(self, from_s, until_s):
        super().__init__()
        self.from_s, self.until_s = from_s, until_s

    def update(self, seen):
        return replace(super().update(seen), is_lost=self.from_s <= seen.time_s < self.until_s)


@pytest.fixture(scope="module")
def finished():
    """A flat, mapped to its last corner."""
    slam = SlamLocalizer()
    assert exploring(FLAT, localizer=slam).run(120.0).status is Status.COMPLETE
    slam.finish()
    return slam


def test_where_it_is_not_found_it_does_not_call_itself_done(finished):
    """The map has nothing left to see, but the robot is elsewhere."""
    elsewhere = exploring(ELSEWHERE, localizer=MapLocalizer(finished))
    last = elsewhere.run(60.0)
    assert (last.status, last.activity) == (Status.EXPLORING, "lost")
    assert {decision.twist for decision in elsewhere.decisions} == {Twist2.zero()}


def test_once_it_is_found_it_ends(finished):
    flat = exploring(FLAT, localizer=MapLocalizer(finished))
    assert flat.run(60.0).status is Status.COMPLETE
    assert flat.decisions[0].activity == "lost"
    assert "the robot is found" in flat.events


def test_lost_on_its_way_it_stands_and_maps_nothing_then_goes_on():
    flat = exploring(FLAT, localizer=Losing(10.0, 80.0))
    before = flat.run(10.0)
    assert before.goal is not None
    known = flat.explorer.grid.log_odds.copy()
    lost = flat.run(69.0)
    assert (lost.activity, lost.goal, lost.path) == ("lost", None, None)
    assert {decision.twist for decision in flat.decisions if decision.activity == "lost"} == {Twist2.zero()}
    np.testing.assert_array_equal(flat.explorer.grid.log_odds, known)
    assert flat.run(300.0).status is Status.COMPLETE
    assert flat.explored() > 0.99
    assert not any("gave up" in event for event in flat.events)


def test_found_again_it_makes_sure_before_it_ends():
    """That there was no goal before it got lost says nothing about where it is now."""
    cell = exploring(CELL)
    done_s = cell.run(60.0) and cell.world.time_s
    lost = exploring(CELL, localizer=Losing(done_s - 0.5, done_s + 9.5))
    assert lost.run(60.0).status is Status.COMPLETE
    assert lost.world.time_s >= done_s + 9.5 + lost.explorer.config.ending.confirm_s - 0.2


def test_an_explorer_that_has_ended_stays_so_when_its_robot_is_carried_away():
    cell = exploring(CELL, localizer=Losing(40.0, 50.0))
    assert cell.run(40.0).status is Status.COMPLETE
    cell.world.time_s = 45.0
    again = cell.explorer.decide(cell.observe())
    assert (again.status, again.activity) == (Status.COMPLETE, "complete")
