"""A few places that see all there is to be seen."""

from __future__ import annotations

import numpy as np

from occmap.coarse_map import CoarseMap
from occmap.lookouts import lookouts
from occmap.search import SearchMemory
from tests.occmap.goal_scenes import Scene

TWO_NICHES = """
    ####?????##?????####
    ####?????##?????####
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################"""
"""Two gaps in a wall, half a metre apart."""

APART = """
    ########################################
    ?......................................?
    ?......................................?
    ?......................................?
    ?......................................?
    ########################################"""

SLOT = """
    ######?######
    ######.######
    ######.######
    ######.######
    ######.######
    #...........#
    #...........#
    #...........#
    #...........#
    #...........#
    #############"""


def found_in(scene, failed=0):
    wave = scene.flood()
    coarse = CoarseMap(wave.terrain, SearchMemory())
    start = coarse.block_near(scene.start)
    assert start is not None
    costs_m = coarse.costs_from_m(start)
    sights = [scene.chooser.sight_of(frontier, scene.grid, failed) for frontier in scene.frontiers]
    return coarse, lookouts(coarse, sights, costs_m)


def test_one_place_is_enough_for_what_it_sees_together():
    scene = Scene(TWO_NICHES, (2, 4))
    assert len(scene.frontiers) == 2
    coarse, (only,) = found_in(scene)
    assert only.is_exact
    assert sorted(only.members) == [0, 1]
    ix, iy = coarse.cell_in(only.block)
    sight = [scene.chooser.sight_of(frontier, scene.grid, 0) for frontier in scene.frontiers]
    for each in sight:
        away = np.hypot(*(each.targets[:, :2] - (ix, iy)).T)
        assert (away <= each.reach_cells).mean() >= 0.5


def test_what_lies_apart_takes_several_and_each_frontier_has_one():
    scene = Scene(APART, (20, 2))
    _, found = found_in(scene)
    assert len(found) == 2
    assert sorted(k for each in found for k in each.members) == [0, 1]


def test_after_a_look_in_vain_the_place_is_nearer():
    scene = Scene(APART, (20, 2))
    for failed, most_m in ((0, 2.7), (1, 1.4), (2, 0.7)):
        coarse, found = found_in(scene, failed)
        for each in found:
            x_m, _ = scene.grid.frame.centre_of(*coarse.cell_in(each.block))
            frontier_x_m, _ = scene.frontiers[each.members[0]].centroid_in_map
            assert abs(x_m - frontier_x_m) <= most_m


def test_a_frontier_that_no_block_sees_into_is_stood_for_by_the_nearest():
    """The body does not fit into the slot, and what is left to see is 1.5 m within."""
    scene = Scene(SLOT, (6, 8), body=None)
    (frontier,) = scene.frontiers
    _, (seen,) = found_in(scene)
    assert seen.is_exact
    coarse, (unseen,) = found_in(scene, failed=2)
    assert not unseen.is_exact
    assert unseen.block == coarse.block_of(frontier)
