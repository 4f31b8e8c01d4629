"""Rooms on a coarse raster: connected, bare, enclosed, and decided by the seed alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from sim.generators import BuildingConfig, generate
from sim.generators.rooms import CELL_M, CORRIDOR_M, draw_room, joined_pairs
from sim.starts import BODY_RADIUS_M
from sim.truth import reachable, truth_grid

SIZE_M = (40.0, 30.0)


def built(seed, size_m=SIZE_M):
    return generate(BuildingConfig("rooms", size_m=size_m), np.random.default_rng(seed))


def raster(building):
    """Which cells of the generator's own raster are solid; cells are asked at their middle."""
    truth = truth_grid(building, CELL_M / 8)
    nx, ny = (int(side / CELL_M + 1e-9) for side in building.high_m)
    x, y = (np.arange(nx) + 0.5) * CELL_M, (np.arange(ny) + 0.5) * CELL_M
    ix, iy = truth.cell_from_world(np.column_stack([a.ravel() for a in np.meshgrid(x, y)])).T
    return truth.wall[iy, ix].reshape(ny, nx)


@pytest.mark.parametrize("seed", range(5))
def test_all_floor_is_one_piece_and_walls_enclose_it(seed):
    solid = raster(built(seed))
    assert solid[[0, -1]].all()
    assert solid[:, [0, -1]].all()
    assert ndimage.label(~solid)[1] == 1
    assert 0.15 < (~solid).mean() < 0.75


@pytest.mark.parametrize("seed", range(5))
def test_the_robot_gets_everywhere(seed):
    building = built(seed)
    truth = truth_grid(building, 0.1)
    reached = reachable(truth, building.start, BODY_RADIUS_M)
    shunned_m = ndimage.distance_transform_edt(~reached) * truth.resolution_m
    (x0, y0), (x1, y1) = truth.cell_from_world(np.array([building.low_m, building.high_m]))
    inside = slice(y0, y1), slice(x0, x1)
    assert shunned_m[inside][~truth.wall[inside]].max() < 0.4  # corners and the strip along the walls


def test_no_passage_is_narrower_than_a_corridor():
    narrowest = round(CORRIDOR_M[0] / CELL_M)
    floor = ~raster(built(1))
    opened = ndimage.binary_opening(floor, np.ones((narrowest, narrowest)))
    assert opened.sum() > 0.95 * floor.sum()


def test_the_seed_alone_decides():
    assert built(3) == built(3)
    assert built(3) != built(4)


def test_its_default_size_is_that_of_the_maps_it_imitates():
    building = generate(BuildingConfig("rooms"), np.random.default_rng(0))
    assert building.high_m == (100.0, 100.0)
    assert {solid.kind for solid in building.solids} == {"wall"}


def test_rooms_stay_off_the_rim_also_where_the_building_is_small():
    rng = np.random.default_rng(0)
    for _ in range(200):
        x0, y0, x1, y1 = draw_room(20, 20, rng)
        assert 1 <= x0 < x1 <= 19
        assert 1 <= y0 < y1 <= 19


def test_corridors_join_all_rooms():
    rng = np.random.default_rng(0)
    drawn = [draw_room(200, 200, rng) for _ in range(20)]
    drawn[1] = drawn[0]  # one room on top of another is joined to it, too
    joined = np.eye(20, dtype=bool)
    for a, b in joined_pairs(drawn, rng):
        joined[a, b] = joined[b, a] = True
    assert np.linalg.matrix_power(joined.astype(int), 20).all()
