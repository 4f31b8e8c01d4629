"""Clearance: exact after any sequence of flips, as if computed afresh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from occmap.clearance import ClearanceConfig, ClearanceMap
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.mapper import GridChange


def expected(grid: OccupancyGrid, truncate_m: float) -> np.ndarray:
    """The NumPy twin: scipy's transform of the whole grid."""
    occupied = grid.state == Belief.OCCUPIED
    if not occupied.any():
        return np.full(grid.shape, truncate_m)
    r = grid.config.resolution_m
    return np.clip(distance_transform_edt(~occupied) * r - r / 2, 0.0, truncate_m)


def grid_of(ny: int, nx: int, resolution_m: float = 0.05) -> OccupancyGrid:
    grid = OccupancyGrid(GridConfig(resolution_m=resolution_m))
    grid.grow_to_contain((0.0, 0.0), ((nx - 0.5) * resolution_m, (ny - 0.5) * resolution_m))
    assert grid.shape == (ny, nx)
    return grid


def flip(grid: OccupancyGrid, flat_cells: np.ndarray, states: np.ndarray) -> GridChange:
    was = grid.state.ravel()[flat_cells]
    grid.state.ravel()[flat_cells] = states
    return GridChange(False, flat_cells.astype(np.int32), was, grid.state)


@pytest.mark.parametrize("resolution_m", [0.05, 0.1])
@pytest.mark.parametrize("density", [0.002, 0.05, 0.5])
def test_any_sequence_of_flips_gives_the_exact_transform(density: float, resolution_m: float):
    rng = np.random.default_rng(0)
    grid, clearance = grid_of(70, 90, resolution_m), ClearanceMap()
    clearance.rebuild(grid)
    for _ in range(15):
        cells = rng.choice(grid.state.size, 80, replace=False)
        states = np.where(rng.random(80) < density, Belief.OCCUPIED, rng.integers(0, 2, 80))
        clearance.update(grid, flip(grid, cells, states.astype(np.uint8)))
        np.testing.assert_allclose(clearance.distance_m, expected(grid, 1.0), atol=1e-6)


def test_an_obstacle_that_comes_and_goes_leaves_no_trace():
    grid, clearance = grid_of(60, 60), ClearanceMap()
    clearance.rebuild(grid)
    clearance.update(grid, flip(grid, np.array([1830]), np.array([Belief.OCCUPIED])))
    assert clearance.distance_m.min() == 0.0
    clearance.update(grid, flip(grid, np.array([1830]), np.array([Belief.FREE])))
    assert (clearance.distance_m == 1.0).all()


def test_distances_are_from_the_centre_to_the_obstacles_edge_and_truncated():
    grid, clearance = grid_of(3, 60), ClearanceMap(ClearanceConfig(truncate_m=0.5))
    grid.state[1, 0] = Belief.OCCUPIED
    clearance.rebuild(grid)
    np.testing.assert_allclose(clearance.distance_m[1, :4], [0.0, 0.025, 0.075, 0.125], atol=1e-6)
    assert (clearance.distance_m[1, 11:] == 0.5).all()


def test_unknown_and_free_cells_are_no_obstacles():
    grid, clearance = grid_of(10, 10), ClearanceMap()
    grid.state[5:] = Belief.FREE
    clearance.rebuild(grid)
    assert (clearance.distance_m == 1.0).all()


def test_a_grid_that_grew_is_measured_anew():
    grid, clearance = grid_of(20, 20), ClearanceMap()
    grid.state[0, 0] = Belief.OCCUPIED
    clearance.rebuild(grid)
    grew = grid.grow_to_contain((-1.0, -1.0), (1.0, 1.0))
    clearance.update(grid, GridChange(grew, np.empty(0, np.int32), np.empty(0, np.uint8), grid.state))
    np.testing.assert_allclose(clearance.distance_m, expected(grid, 1.0), atol=1e-6)


def test_another_grid_of_the_same_shape_is_measured_anew_where_the_last_one_was():
    """Nothing of the last one is left; and no memory is asked for, which takes long on a large map."""
    clearance = ClearanceMap()
    for cell in (30, 310):
        grid = grid_of(20, 20)
        grid.state.ravel()[cell] = Belief.OCCUPIED
        clearance.rebuild(grid)
        memory = clearance.distance_m
        np.testing.assert_allclose(memory, expected(grid, 1.0), atol=1e-6)
    clearance.rebuild(grid_of(20, 20))
    assert clearance.distance_m is memory
    assert (memory == 1.0).all()


def test_a_truncation_of_more_cells_than_a_byte_counts_is_refused():
    with pytest.raises(ValueError, match="truncate_m"):
        ClearanceMap(ClearanceConfig(truncate_m=20.0)).rebuild(grid_of(3, 3))
