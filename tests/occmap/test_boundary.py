"""Outside of a boundary nothing is explored, nowhere is driven, and the certificate says so."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.boundary import BAND_M, Boundary, are_within, polygon
from occmap.decision import Reason, Status
from occmap.explorer import ExplorerConfig
from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.planner import Planner
from tests.occmap.explored_worlds import FLAT, exploring
from tests.occmap.goal_scenes import NO_MARGINS, SMALL_BODY, Scene

SQUARE = ((-1.0, -1.0), (2.0, -1.0), (2.0, 2.0), (-1.0, 2.0))
NOTCHED = ((-2.0, -2.0), (4.0, -2.0), (4.0, 4.0), (1.0, 0.5), (-2.0, 4.0))

HALL = """??????????????????????
          ?....................?
          ?....................?
          ?....................?
          ?....................?
          ?....................?
          ?....................?
          ?....................?
          ??????????????????????"""


@pytest.mark.parametrize("corners", [SQUARE, SQUARE[::-1], NOTCHED, NOTCHED[::-1]])
def test_within_is_what_matplotlib_calls_within(corners):
    from matplotlib.path import Path

    places = np.random.default_rng(0).uniform(-3.0, 5.0, (2000, 2))
    np.testing.assert_array_equal(are_within(polygon(corners), places), Path(corners).contains_points(places))


def test_corners_run_counter_clockwise_whichever_way_they_are_given():
    np.testing.assert_array_equal(polygon(SQUARE[::-1]), SQUARE)


@pytest.mark.parametrize(
    ("corners", "mistake"),
    [
        ((), "three corners"),
        (SQUARE[:2], "three corners"),
        (((0.0, 0.0), (1.0, math.nan), (1.0, 1.0)), "finite"),
        (((0.0, 0.0), (1.0, 1.0), (3.0, 3.0)), "on one line"),
    ],
)
def test_what_encloses_nothing_is_no_boundary(corners, mistake):
    with pytest.raises(ValueError, match=mistake):
        polygon(corners)


def test_sides_that_cross_are_named_and_sides_that_touch_are_none():
    bow_tie = [(5.0, 9.0), (13.0, 0.0), (13.0, 9.0), (5.0, 2.0)]
    with pytest.raises(ValueError, match=r"\[5.0, 9.0\]-\[13.0, 0.0\] and \[13.0, 9.0\]-\[5.0, 2.0\] cross"):
        polygon(bow_tie)
    with pytest.raises(ValueError, match="cross"):  # its halves are as large as each other
        polygon([(0.0, 0.0), (9.0, 7.0), (9.0, 0.0), (0.0, 7.0)])
    touching = Pose2(3.0, 1.0, 0.7).apply(np.array([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], float))
    assert len(polygon([(x, y) for x, y in touching.tolist()])) == 5


def test_the_start_must_be_within():
    with pytest.raises(ValueError, match="must hold the place where the robot starts"):
        Boundary([(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)])


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, math.pi / 4.0])
def test_no_way_leads_across(turn_rad):
    scene = Scene(HALL)
    c, s = 2.2 * math.cos(turn_rad), 2.2 * math.sin(turn_rad)
    boundary = Boundary([(-c + s, -s - c), (c + s, s - c), (c - s, s + c), (-c - s, -s + c)])
    planner = Planner(NO_MARGINS, SMALL_BODY, boundary)
    wave = planner.flood(scene.grid, scene.clearance.distance_m, scene.start)
    cost, below = wave.raw_costs()
    iy, ix = np.nonzero(cost < below)
    assert 10 < len(ix) < np.count_nonzero(scene.grid.state == Belief.FREE)
    assert are_within(boundary.corners, scene.grid.frame.map_from_cell(np.column_stack((ix, iy)))).all()


@pytest.mark.parametrize("corners", [SQUARE, SQUARE[::-1]])
def test_the_closed_band_lies_on_the_outer_side(corners):
    """Floor within is lost to it by no more than a cell."""
    grid = OccupancyGrid(GridConfig(resolution_m=0.05))
    grid.grow_to_contain((-2.0, -2.0), (3.0, 3.0))
    iy, ix = np.divmod(Boundary(corners).closed_cells(grid), grid.shape[1])
    x_m, y_m = grid.frame.map_from_cell(np.column_stack((ix, iy))).T
    beyond_m = np.maximum(np.abs(x_m - 0.5), np.abs(y_m - 0.5)) - 1.5  # of the square's sides
    assert beyond_m.min() > -0.05
    assert BAND_M - 0.05 < beyond_m.max() < BAND_M + 0.05


def test_a_frontier_that_the_boundary_cuts_is_cut():
    scene = Scene(HALL)
    boundary = Boundary([(-1.0, -1.0), (1.6, -1.0), (1.6, 9.0), (-1.0, 9.0)])
    within, beyond = boundary.split(scene.frontiers, scene.grid)
    for frontiers, is_within in ((within, True), (beyond, False)):
        assert frontiers
        for frontier in frontiers:
            places = scene.grid.frame.map_from_cell(frontier.cells)
            assert (are_within(boundary.corners, places) == is_within).all()
            assert frontier.size == len(frontier.cells)
            assert frontier.centroid_in_map == pytest.approx(tuple(places.mean(axis=0)))
    assert sum(each.size for each in (*within, *beyond)) == sum(each.size for each in scene.frontiers)


def test_frontiers_are_split_together_as_each_alone():
    scene, boundary = Scene(HALL), Boundary(NOTCHED)
    within, beyond = boundary.split(scene.frontiers, scene.grid)
    alone = [boundary.split([frontier], scene.grid) for frontier in scene.frontiers]
    for found, each in zip((within, beyond), zip(*alone, strict=True), strict=True):
        cells = [frontier.cells.tolist() for frontiers in each for frontier in frontiers]
        assert [frontier.cells.tolist() for frontier in found] == cells
    assert boundary.split([], scene.grid) == ([], [])


@pytest.mark.parametrize("strategy", ["nearest", "tour"])
def test_a_robot_keeps_within_and_names_what_is_beyond(strategy):
    """The flat's left half: its doors to the right stay undriven."""
    config = ExplorerConfig(boundary_in_map=((-9.0, -9.0), (0.6, -9.0), (0.6, 9.0), (-9.0, 9.0)))
    free, bound = exploring(FLAT), exploring(FLAT, config)
    assert bound.run(300.0).status is free.run(300.0).status is Status.COMPLETE
    trail = np.array([each.map_from_robot.position for each in bound.decisions])
    assert trail[:, 0].max() < 0.75
    assert Reason.OUTSIDE in bound.reasons()
    assert bound.world.time_s < free.world.time_s
