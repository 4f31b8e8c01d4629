"""Slits along walls: what is one, and where to look into it from."""

from __future__ import annotations

import numpy as np

from occmap.goal_config import GoalConfig
from occmap.goals import GoalChooser
from occmap.grid import Belief
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.nooks import Nooks
from tests.occmap.goal_scenes import Scene


def slit_scene(depth):
    """A room of 1 m x 1 m at 5 cm, with a slit in its upper wall: six cells wide and `depth` deep."""
    upper = ["#" * 11 + "??????" + "#" * 5] * depth
    picture = "\n".join(["#" * 22, *upper, *["#" + "." * 20 + "#"] * 20, "#" * 22])
    return Scene(picture, (10, 10), resolution_m=0.05, body=None)


def nook_goal(scene, config=None):
    nooks = Nooks(GoalChooser(config or GoalConfig()), FailedLooks(), LookedAt(), None)
    (mouth,) = scene.frontiers
    return nooks.goal_into(mouth, scene.grid, scene.flood(), 2.5)


def test_a_nook_is_looked_into_from_where_it_runs():
    goal = nook_goal(slit_scene(12))
    assert goal is not None
    assert goal.is_nook
    assert abs(goal.viewpoint_in_map[0] - 0.7) < 0.3  # beneath the slit


def test_a_nook_is_gone_when_its_own_cells_are_known():
    scene = slit_scene(12)
    nook = nook_goal(scene)
    nothing = np.zeros_like(scene.edges.mask)
    assert not scene.chooser.is_gone(nook, scene.grid, nothing)  # the rim is not in the frontier map
    scene.grid.state[scene.grid.state == Belief.UNKNOWN] = Belief.FREE
    assert scene.chooser.is_gone(nook, scene.grid, nothing)


def test_a_nook_is_wide_and_deep_and_untouched_by_beams():
    assert nook_goal(slit_scene(12)) is not None
    assert nook_goal(slit_scene(3)) is None  # the dents of a wall
    assert nook_goal(slit_scene(12), GoalConfig(min_nook_m=0.4)) is None
    touched = slit_scene(12)
    touched.grid.log_odds[touched.grid.state == Belief.UNKNOWN] = 0.5  # votes both ways: cells that flicker
    assert nook_goal(touched) is None
