"""What is worth the way: fresh frontiers that promise something, leftovers only in passing."""

from __future__ import annotations

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.goal_config import GoalConfig
from occmap.views import BAD_LUCK
from tests.occmap.goal_scenes import goal_at
from tests.occmap.test_goal_search import Searching


def corridor(recess_cells, deep_cells=24, length=900, wide=16):
    """45 m x 0.8 m in cells of 0.05 m; beside its far end opens what has not been seen."""
    wall = "#" * (length - 20)
    recess = [wall + "?" * recess_cells + "#" * (22 - recess_cells)] * deep_cells
    return "\n".join(["#" * (length + 2), *recess, *["#" + "." * length + "#"] * wide, "#" * (length + 2)])


def scene_of(picture, start_x, start_y=8, **config):
    config = GoalConfig(min_nook_m=9.0, **config)
    return Searching(picture, (start_x, start_y), resolution_m=0.05, body=None, config=config)


def looked_into(scene, times=1):
    """The same scene after looks at its only frontier that changed nothing."""
    (frontier,) = scene.frontiers
    goal = scene.chooser.goal_for(frontier, scene.grid, scene.flood(), 2.5, 0.2)
    for _ in range(times):
        scene.search.looked_at.note(goal, scene.grid)
    return scene


NARROW, WIDE = 5, 20


@pytest.mark.parametrize(
    ("cells", "looks", "is_worth"),
    [(NARROW, 0, True), (NARROW, 1, False), (WIDE, 0, True), (WIDE, 1, True), (WIDE, 2, False)],
)
def test_what_was_looked_into_is_not_come_back_for_from_afar(cells, looks, is_worth):
    """Where the body could go on, one look more is worth the way: the frontier may have moved on."""
    scene = looked_into(scene_of(corridor(cells), 5), looks)
    assert (scene.run().best is not None) == is_worth


@pytest.mark.parametrize(("deep_cells", "is_worth"), [(24, True), (1, False)])
@pytest.mark.parametrize("looks", [0, 2, 5])
def test_in_a_tight_passage_what_is_near_is_looked_into_if_it_promises_much(deep_cells, is_worth, looks):
    """5 m of a passage 0.55 m wide cost more than 10 m in the open; looks next door count for all of it."""
    scene = looked_into(scene_of(corridor(WIDE, deep_cells, wide=11), 785, start_y=6), looks)
    assert scene.flood().cost_at(np.array([(880, 6)]))[0] > 10.0
    assert (scene.run().best is not None) == is_worth


@pytest.mark.parametrize("cells", [NARROW, WIDE])
def test_from_near_it_is_looked_into_again(cells):
    assert looked_into(scene_of(corridor(cells), 850), times=2).run().best is not None


def test_where_the_body_could_go_on_a_look_that_was_had_near_by_demands_no_more_of_a_promise():
    """A recess of 1 m x 0.2 m, of which only a part has been seen: the look was at something beside it."""
    scene = looked_into(scene_of(corridor(WIDE, deep_cells=4), 5))
    assert scene.run().best is not None


@pytest.mark.parametrize(("deep_cells", "is_worth"), [(1, False), (12, True)])
def test_however_long_it_is_what_hides_next_to_nothing_is_not_worth_a_way(deep_cells, is_worth):
    scene = scene_of(corridor(WIDE, deep_cells), 5)
    assert (scene.run().best is not None) == is_worth


def test_what_is_left_is_told():
    scene = looked_into(scene_of(corridor(NARROW), 5))
    wave = scene.flood()
    assert scene.unvisited(wave) == scene.frontiers


@pytest.mark.parametrize(("way_left_m", "is_kept"), [(1.0, True), (90.0, False)])
def test_a_nook_that_is_nearly_reached_is_not_left_for_a_frontier_farther_off(way_left_m, is_kept):
    scene = scene_of(corridor(WIDE), 5)
    nook = goal_at(1.0, 0.4, is_nook=True)
    assert (scene.run(nook, way_left_m).best is nook) == is_kept


def test_where_was_looked_is_remembered_across_a_correction_of_the_map():
    scene = looked_into(scene_of(corridor(NARROW), 5))
    scene.search.carry_over(Pose2(-5.0, 0.0, 0.0))
    assert scene.run().best is not None
    scene.search.carry_over(Pose2(5.0, 0.0, 0.0))
    assert scene.run().best is None


@pytest.mark.parametrize(
    ("wide", "deep", "is_told"), [(1, 12, True), (1, 8, True), (1, 6, False), (3, 12, True)]
)
def test_a_slit_too_narrow_for_a_nook_is_told_if_it_is_deep(wide, deep, is_told):
    """Noise paints a slit of three cells to one; a crack is as wide, but soon meets the wall's other face."""
    scene = scene_of(corridor(wide, deep), 850)
    (mouth, *others) = scene.slits_left() or [None]
    assert (mouth is not None) == is_told
    assert not others


@pytest.mark.parametrize(("in_vain", "is_worth"), [(BAD_LUCK, True), (BAD_LUCK + 5, False)])
@pytest.mark.parametrize("cells", [NARROW, 9])
def test_far_looks_in_vain_make_others_wait_for_more_of_a_promise(cells, in_vain, is_worth):
    scene = scene_of(corridor(cells), 5)
    scene.search.looked_at.in_vain = in_vain
    assert (scene.run().best is not None) == is_worth


def test_what_may_be_a_door_is_looked_into_however_many_far_looks_were_in_vain():
    scene = scene_of("\n".join(["#" * 902, *["#" + "." * 900 + "?"] * 60, "#" * 902]), 5)
    scene.search.looked_at.in_vain = 50
    assert scene.run().best is not None
