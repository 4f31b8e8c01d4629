"""Walls that grazing beams have worn away: restored where they still stand, and nowhere else."""

from __future__ import annotations

import numpy as np

from occmap.clearance import ClearanceConfig
from occmap.decision import Status
from occmap.frontiers import FrontierConfig
from occmap.geometry import Pose2
from occmap.grid import SOLID_HITS, Belief, GridConfig
from occmap.living_map import LivingMap
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig
from occmap.stopwatch import Stopwatch
from occmap.worn_surfaces import worn_cells
from tests.ascii_maps import ascii_grid, cells
from tests.occmap.explored_worlds import FLAT, exploring


def worn(picture, struck, hits=SOLID_HITS):
    """The worn cells of a drawn belief, those of `struck` (iy, ix) having been hit so often."""
    grid = ascii_grid(picture)
    grid.hits[struck] = hits
    found = np.zeros(grid.shape, bool)
    found.ravel()[worn_cells(grid.state, grid.hits)] = True
    return cells(found)


EATEN = """????????
           ????????
           ##.?..##
           ........
           ########"""


def test_free_space_that_ends_where_beams_ended_ends_at_a_wall():
    """Free, or undecided: in front of the unknown both are the wall; the free floor before it is not."""
    assert worn(EATEN, np.s_[2, 2:6]) == {(2, 2), (3, 2), (4, 2), (5, 2)}
    assert worn(EATEN, np.s_[1, 4:7]) == set()  # in the open
    assert worn(EATEN, np.s_[3, 7]) == set()  # inside the wall, with no free space beside


def test_a_stray_return_now_and_then_is_no_wall():
    assert worn(EATEN, np.s_[2, 4:6], SOLID_HITS - 1) == set()
    assert worn(EATEN, np.s_[1, 2:6], 1) == set()  # in the open


def test_free_space_that_ends_in_the_unknown_ends_at_a_wall_if_any_beam_did():
    """Noise puts a return a cell too far; a return in free space is a stray one, or of a wall elsewhere."""
    ragged = """?????
                ?????
                ??.??
                .....
                ....."""
    assert worn(ragged, np.s_[3, 2], 1) == {(1, 2), (2, 3), (3, 2)}
    assert worn(ragged, np.s_[3, 1], 1) == {(1, 2), (2, 3)}
    assert worn(ragged, np.s_[1, 1:4], 1) == set()


def test_a_doors_leaf_is_gone_once_it_has_been_looked_through():
    doorway = """##########
                 #........#
                 ###....###
                 #........#
                 ##########"""
    assert worn(doorway, np.s_[2, 3:7]) == set()
    assert worn(doorway.replace("#........#", "#????????#", 1), np.s_[2, 3:7]) == {
        (x, 2) for x in (3, 4, 5, 6)
    }


def test_all_layers_of_a_map_are_told():
    layers = LivingMap(GridConfig(), SensorModelConfig(), ClearanceConfig(), FrontierConfig())
    for _ in range(8):  # one beam ahead, which ends in one cell again and again
        layers.insert(Scan(np.zeros(1), np.array([1.02]), 2.0), Pose2.identity(), Stopwatch())
    ix, iy = layers.grid.frame.cell_at(1.02, 0.0)
    layers.grid.log_odds[iy, ix], layers.grid.state[iy, ix] = 0.0, Belief.UNKNOWN
    known_m2 = layers.known_m2
    layers.restore_surfaces()
    assert layers.grid.state[iy, ix] == Belief.OCCUPIED
    assert layers.grid.probability()[iy, ix] > layers.grid.config.occupied_above
    assert layers.clearance_m[iy, ix] == 0.0
    assert layers.known_m2 > known_m2


def test_a_map_that_is_handed_over_has_none():
    flat = exploring(FLAT, noise_scale=2.0)
    assert flat.run(300.0).status is Status.COMPLETE
    grid = flat.explorer.grid
    assert not len(worn_cells(grid.state, grid.hits))
    believed = np.where(grid.log_odds > grid.occupied_above, Belief.OCCUPIED, Belief.UNKNOWN)
    believed[grid.log_odds < grid.free_below] = Belief.FREE
    np.testing.assert_array_equal(grid.state, believed)
