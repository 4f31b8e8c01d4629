"""The lesson's worked numbers, through the mapper."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, GridFrame, OccupancyGrid
from occmap.mapper import Mapper
from tests.scans import AHEAD, at, beams

HIT, MISS = 0.85, -0.40


def test_lesson_cell_table():
    mapper, grid = Mapper(), OccupancyGrid()
    believed = [0.5]
    for z in (2.0, 2.0, 2.0, 3.0, 2.0):  # hit, hit, hit, a stray miss, hit
        mapper.insert(beams(AHEAD, [z]), Pose2(0.01, 0.01, 0.0), grid)
        believed.append(1.0 / (1.0 + math.exp(-at(grid, 2.01, 0.01))))
    np.testing.assert_allclose(believed, [0.50, 0.70, 0.85, 0.93, 0.90, 0.95], atol=0.006)


def test_lesson_beam_casts_four_free_votes_and_one_occupied():
    mapper, grid = Mapper(), OccupancyGrid(GridConfig(resolution_m=1.0))
    mapper.insert(beams([math.atan2(2.0, 4.0)], [math.hypot(4.0, 2.0)]), Pose2(0.5, 0.5, 0.0), grid)
    votes = {(ix, iy): at(grid, ix + 0.5, iy + 0.5) for ix in range(5) for iy in range(3)}
    free, occupied = pytest.approx(MISS), pytest.approx(HIT)
    assert {cell: value for cell, value in votes.items() if value} == {
        (0, 0): free,
        (1, 0): free,
        (2, 1): free,
        (3, 1): free,
        (4, 2): occupied,
    }


def test_lesson_three_beams_of_one_scan_make_a_cell_free():
    mapper, grid = Mapper(), OccupancyGrid()
    mapper.insert(beams([-0.001, 0.0, 0.001], [3.0, 3.0, 3.0]), Pose2(0.02, 0.02, 0.0), grid)
    assert at(grid, 1.0, 0.02) == pytest.approx(-1.20)
    ix, iy = grid.frame.cell_at(1.0, 0.02)
    assert grid.probability()[iy, ix] == pytest.approx(0.23, abs=0.005)
    assert grid.state[iy, ix] == Belief.FREE


def test_lesson_pose_facing_north_hits_cell_240_280():
    mapper, grid = Mapper(), OccupancyGrid()
    mapper.insert(beams(AHEAD, [3.0]), Pose2(2.0, 1.0, math.pi / 2), grid)
    lesson = GridFrame(0.05, (-10.0, -10.0))
    iy, ix = np.nonzero(grid.log_odds)
    cells = lesson.cell_from_map(grid.frame.map_from_cell(np.column_stack((ix, iy)))).tolist()
    values = dict(zip(map(tuple, cells), grid.log_odds[iy, ix].tolist(), strict=True))
    assert values.pop((240, 280)) == pytest.approx(HIT)
    assert values == {(240, 220 + k): pytest.approx(MISS) for k in range(60)}


@pytest.mark.parametrize(("clamp", "misses"), [(6.0, 15), (math.inf, 1063)])
def test_lesson_clamp_lets_an_opened_door_be_learnt_in_15_misses(clamp: float, misses: int):
    mapper, grid = Mapper(), OccupancyGrid(GridConfig(clamp=clamp))
    pose = Pose2(0.01, 0.01, 0.0)
    for _ in range(500):
        mapper.insert(beams(AHEAD, [2.0]), pose, grid)
    for _ in range(misses - 1):
        mapper.insert(beams(AHEAD, [3.0]), pose, grid)
    assert at(grid, 2.01, 0.01) > 1e-3
    mapper.insert(beams(AHEAD, [3.0]), pose, grid)
    assert at(grid, 2.01, 0.01) < 1e-3
