"""What cannot be looked into from anywhere stays out of tours, until something there changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from occmap.body import Body
from occmap.frontiers import Frontier
from occmap.goal_config import GoalConfig
from occmap.grid import Belief
from occmap.hopeless import Hopeless
from tests.ascii_maps import grid_of
from tests.occmap.test_goal_search import Searching


@pytest.fixture
def hall():
    """10 m x 10 m of free floor in cells of 0.1 m."""
    return grid_of(np.full((100, 100), Belief.FREE, np.uint8), 0.1)


@pytest.fixture
def frontier():
    return Frontier(np.array([(50, 50), (51, 50)]), (5.05, 5.05), 2)


def test_a_frontier_is_hopeless_once_noted_and_its_like_is_not(hall, frontier):
    hopeless, alike = Hopeless(), replace(frontier)
    assert hopeless.among([frontier], hall) == set()
    hopeless.note(frontier, hall)
    assert hopeless.among([alike, frontier], hall) == {id(frontier)}


def test_it_is_so_no_more_once_it_was_gone(hall, frontier):
    hopeless = Hopeless()
    hopeless.note(frontier, hall)
    assert hopeless.among([], hall) == set()
    assert hopeless.among([frontier], hall) == set()


def test_a_change_near_by_gives_new_hope_and_one_far_off_does_not(hall, frontier):
    hopeless = Hopeless()
    hopeless.note(frontier, hall)
    hall.state[80:] = Belief.UNKNOWN
    assert hopeless.among([frontier], hall)
    hall.state[40:46, 40:60] = Belief.UNKNOWN
    assert not hopeless.among([frontier], hall)


def corridor_with_slot():
    """6 m x 1 m, open to the right; beside it a slot 0.4 m wide and 1.5 m deep that leads on."""
    slot = ["#" * 30 + edge * 4 + "#" * 27 for edge in "?" + 15 * "."]
    return "\n".join([*slot, *["#" + "." * 59 + "?"] * 10, "#" * 61])


def test_a_tour_tries_what_is_hopeless_only_once():
    """The end of the slot is in plain sight, but looks are to be from 0.5 m, and the body gets no nearer."""
    config = GoalConfig(look_from_m=(0.5,), look_into_m=(0.25,))
    body = Body(radius_m=0.4)
    scene = Searching(corridor_with_slot(), start=(5, 5), resolution_m=0.1, body=body, config=config)
    floods = []
    for _ in range(2):
        best = scene.run().best
        assert best is not None
        assert best.frontier.centroid_in_map[0] > 5.0
        floods.append(len(scene.bounds_m))
    assert floods == [4, 2]  # the first look around, two at the slot, and the stop at the corridor's end
