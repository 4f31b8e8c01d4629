"""What thinks ahead: the order of frontiers on a tour."""

from __future__ import annotations

import numpy as np
import pytest

from occmap.coarse_map import CoarseMap
from occmap.goal_config import GoalConfig
from occmap.search import SearchMemory
from occmap.tour import MOST_STOPS, Tour, TourConfig
from tests.occmap.goal_scenes import Scene

CELL_M = 0.25


def scene_of(picture, start):
    """Drawn at half a metre a letter, so that the robot has room in a corridor three letters wide."""
    lines = [line.strip() for line in picture.strip("\n").splitlines()]
    twice = "\n".join("".join(2 * letter for letter in line) for line in lines for _ in range(2))
    return Scene(twice, (2 * start[0], 2 * start[1]), resolution_m=CELL_M)


def stops(scene, config=None, pursued=None):
    wave = scene.flood()
    sights = [scene.chooser.sight_of(frontier, scene.grid, 0) for frontier in scene.frontiers]
    found = Tour(config or TourConfig()).stops(sights, wave.terrain, scene.start, pursued)
    return [[scene.frontiers[k].centroid_in_map for k in stop.members] for stop in found]


ONE_LONG_WAY_AND_ONE_SHORT = """
    ##########################################
    ?........................................?
    ?........................................?
    ?........................................?
    ##########################################"""


def test_a_tour_takes_the_short_end_of_a_corridor_first():
    """The nearest is the same here."""
    scene = scene_of(ONE_LONG_WAY_AND_ONE_SHORT, (15, 2))
    (first, second) = stops(scene)
    assert first[0][0] < 1.0
    assert second[0][0] > 20.0


A_NICHE_ON_THE_LONG_SIDE = """
    ###############?################
    ?..............................?
    ?..............................?
    ?..............................?
    ################################"""


def test_what_is_nearest_is_not_first_if_it_lies_on_the_way_to_the_rest():
    """The niche is 3.5 m to the right, the short end 4 m to the left; the long end beyond the niche."""
    scene = scene_of(A_NICHE_ON_THE_LONG_SIDE, (8, 2))
    assert [round(places[0][0]) for places in stops(scene)] == [1, 8, 15]


def test_the_way_back_from_its_end_counts():
    """From the upper left of a hall: down and across is the shorter way, but it ends as far off as can be."""
    rows = [list("#" + 42 * "." + "#") for _ in range(30)]
    rows[0], rows[-1] = list(44 * "#"), list(44 * "#")
    rows[0][15] = rows[4][-1] = rows[-5][0] = "?"
    scene = scene_of("\n".join("".join(row) for row in rows), (7, 25))
    for share, is_down_first in ((0.0, True), (0.8, False)):
        ((_, y_m),), *_ = stops(scene, TourConfig(return_share=share))
        assert (y_m < 3.0) == is_down_first


@pytest.mark.parametrize(
    ("hysteresis_m", "share", "stays"),
    [(0.0, 0.0, False), (6.0, 0.0, True), (0.0, 0.01, False), (0.0, 0.5, True)],
)
def test_the_first_stop_is_kept_unless_the_tour_gets_much_shorter(hysteresis_m, share, stays):
    """By so many metres, or by so much of the way to it, which is 12 m here."""
    scene = scene_of(ONE_LONG_WAY_AND_ONE_SHORT, (18, 2))
    right = max(range(len(scene.frontiers)), key=lambda k: scene.frontiers[k].centroid_in_map)
    config = TourConfig(hysteresis_m=hysteresis_m, hysteresis_share=share)
    assert (stops(scene, config, pursued=right)[0][0][0] > 20.0) == stays


def test_what_is_out_of_reach_is_no_stop():
    scene = scene_of(
        """
        ####################
        ?.......#..........?
        ?.......#..........?
        ?.......#..........?
        ####################""",
        (4, 2),
    )
    assert len(scene.frontiers) == 2
    ((only,),) = stops(scene)
    assert only[0] < 1.0
    walled_in = scene_of("#####\n#...#\n#...#\n#...#\n#####", (2, 2))
    assert stops(walled_in) == []


def test_many_frontiers_are_drawn_together_and_each_is_visited_once():
    rows = ["#" * 64]
    for _ in range(8):
        rows += ["?" + "." * 62 + "?"] * 3 + ["#..." + "###..." * 10]
    scene = scene_of("\n".join([*rows, "#" * 64]), (30, 5))
    assert len(scene.frontiers) > MOST_STOPS
    found = stops(scene, TourConfig(stop_m=0.01, stop_share=0.01))
    assert len(found) <= MOST_STOPS
    visited = [place for stop in found for place in stop]
    assert sorted(visited) == sorted(frontier.centroid_in_map for frontier in scene.frontiers)


def test_costs_on_the_coarse_map_are_those_of_the_fine_one_about():
    scene = scene_of(A_NICHE_ON_THE_LONG_SIDE, (2, 2))
    wave = scene.flood()
    coarse = CoarseMap(wave.terrain, SearchMemory())
    start = coarse.block_near(scene.start)
    cells = np.array([[50, 4], [24, 5], [10, 4]])
    blocks = np.array([coarse.block_near(tuple(cell)) for cell in cells.tolist()])
    np.testing.assert_allclose(coarse.costs_m(start, blocks), wave.cost_at(cells), atol=1.0)


@pytest.mark.parametrize("wrong", [{"stop_m": -1.0}, {"stop_m": 0.0}, {"return_share": np.nan}])
def test_nonsense_is_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        GoalConfig(strategy="tour", tour=TourConfig(**wrong))
