"""A gap that held the robot up is not planned through until nothing else is left or the map changes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.barred import BarredGaps, gap_at
from occmap.clearance import ClearanceMap
from occmap.geometry import Pose2
from occmap.grid import Belief, OccupancyGrid
from occmap.planner import Planner

HERE, BEYOND = (0.5, 1.5), (2.5, 1.5)


def two_rooms(gap_m=0.40, turn_rad=0.0):
    """Free floor with a wall across it at x = 1.5, and a gap in that at y = 1.5; turned about the gap."""
    grid = OccupancyGrid()
    grid.grow_to_contain((-1.0, -1.0), (4.0, 4.0))
    iy, ix = np.indices(grid.shape)
    places = grid.frame.map_from_cell(np.column_stack((ix.ravel(), iy.ravel()))) - 1.5
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    x, y = (places @ np.array([[c, -s], [s, c]])).T.reshape(2, *grid.shape)
    grid.state[:] = Belief.FREE
    grid.state[(np.abs(x) < 0.06) & (np.abs(y) > 0.5 * gap_m)] = Belief.OCCUPIED
    clearance = ClearanceMap()
    clearance.rebuild(grid)
    return grid, clearance.distance_m


def way(planner, grid, clearance_m):
    cells = [grid.frame.cell_at(*place) for place in (HERE, BEYOND)]
    return planner.flood(grid, clearance_m, cells[0]).path_to(cells[1])


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, math.pi / 4])
def test_what_held_the_robot_up_twice_is_closed_and_the_map_is_left_as_it_is(turn_rad):
    grid, clearance_m = two_rooms(turn_rad=turn_rad)
    planner, believed = Planner(), grid.state.copy()
    for is_closed in (False, False, True):
        path = way(planner, grid, clearance_m)
        assert (path is None) == is_closed
        if path is not None:
            gap = planner.gap_ahead(path, grid, clearance_m, from_m=0.6)
            assert math.dist(gap.in_map, (1.5, 1.5)) < 0.15
            assert planner.barred.note(gap)
    assert np.array_equal(grid.state, believed)
    assert not planner.barred.note(gap)  # it was closed: something else is to blame


def test_a_wide_door_is_no_gap():
    grid, clearance_m = two_rooms(gap_m=1.2)
    planner = Planner()
    assert planner.gap_ahead(way(planner, grid, clearance_m), grid, clearance_m, from_m=0.6) is None


def test_each_gap_gets_one_more_chance_when_nothing_else_is_left():
    grid, clearance_m = two_rooms()
    planner = Planner()
    gap = planner.gap_ahead(way(planner, grid, clearance_m), grid, clearance_m, from_m=0.6)
    assert not planner.barred.reopen()
    for _ in range(2):
        planner.barred.note(gap)
    assert planner.barred.reopen()
    assert way(planner, grid, clearance_m) is not None
    for _ in range(2):
        planner.barred.note(gap)
    assert not planner.barred.reopen()
    assert way(planner, grid, clearance_m) is None


def test_a_gap_is_forgotten_where_the_map_has_changed():
    grid, _ = two_rooms()
    gaps, gap = BarredGaps(), gap_at((1.5, 1.5), 0.0, 0.2, grid)
    assert gaps.note(gap)
    assert gaps.note(gap)
    assert len(gaps.closed_cells(grid))
    ix, iy = grid.frame.cell_at(1.5, 1.5)
    grid.state[iy : iy + 20, ix : ix + 20] = Belief.UNKNOWN
    assert not len(gaps.closed_cells(grid))


def test_a_gap_follows_a_correction_of_the_map():
    gap = gap_at((1.5, 1.5), 0.0, 0.2, two_rooms()[0])
    moved = gap.carried(Pose2(1.0, 0.0, math.pi / 2))
    assert moved.in_map == pytest.approx((-0.5, 1.5))
    assert moved.direction_rad == pytest.approx(math.pi / 2)
