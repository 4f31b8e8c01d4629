"""The grid: metres and cells, growth, and what log-odds mean."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from occmap.grid import GridConfig, GridFrame, OccupancyGrid

METRES = st.floats(-100.0, 100.0)
RESOLUTIONS = st.sampled_from([0.02, 0.05, 0.1, 0.25])


def test_lesson_cells_of_a_20_m_floor():
    frame = GridFrame(0.05, (-10.0, -10.0))
    assert frame.cell_at(2.0, 1.0) == (240, 220)
    assert frame.cell_at(2.0, 4.0) == (240, 280)
    assert frame.centre_of(240, 280) == pytest.approx((2.025, 4.025))


def test_points_left_of_the_origin_are_floored():
    frame = GridFrame(0.05, (0.0, 0.0))
    assert frame.cell_at(-0.01, -0.06) == (-1, -2)
    assert frame.cell_from_map(np.array([[-0.01, -0.06]])).tolist() == [[-1, -2]]


@given(st.integers(-4000, 4000), st.integers(-4000, 4000), RESOLUTIONS, st.integers(-4000, 4000))
def test_cell_to_map_to_cell_is_the_identity(ix: int, iy: int, resolution_m: float, offset: int):
    frame = GridFrame(resolution_m, (offset * resolution_m, -offset * resolution_m))
    cell = np.array([[ix, iy]])
    np.testing.assert_array_equal(frame.cell_from_map(frame.map_from_cell(cell)), cell)
    assert frame.cell_at(*frame.centre_of(ix, iy)) == (ix, iy)


@given(METRES, METRES, RESOLUTIONS)
def test_a_point_is_within_half_a_cell_of_its_cells_centre(x_m: float, y_m: float, resolution_m: float):
    frame = GridFrame(resolution_m, (0.0, 0.0))
    centre = frame.centre_of(*frame.cell_at(x_m, y_m))
    assert max(abs(centre[0] - x_m), abs(centre[1] - y_m)) <= 0.5 * resolution_m + 1e-6


@given(st.integers(-5000, 5000), RESOLUTIONS)
def test_rounding_never_moves_the_start_to_another_cell(offset: int, resolution_m: float):
    frame = GridFrame(resolution_m, (offset * resolution_m, 0.0))
    assert frame.cell_at(0.0, 0.0) == (-offset, 0)


@given(st.lists(st.tuples(METRES, METRES), min_size=1, max_size=8))
def test_growing_keeps_every_belief_where_it_was(places: list[tuple[float, float]]):
    grid = OccupancyGrid(GridConfig(resolution_m=0.5))
    for k, (x_m, y_m) in enumerate(places):
        grid.grow_to_contain((x_m, y_m), (x_m, y_m))
        ix, iy = grid.frame.cell_at(x_m, y_m)
        grid.log_odds[iy, ix] = k + 1
    written = {}
    for k, (x_m, y_m) in enumerate(places):
        written[grid.frame.cell_at(x_m, y_m)] = k + 1
    found = {(ix, iy): grid.log_odds[iy, ix] for iy, ix in np.argwhere(grid.log_odds != 0.0).tolist()}
    assert found == written
    assert grid.state.shape == grid.log_odds.shape


@pytest.mark.parametrize(("dx", "dy"), [(0.01, 0.0), (-0.01, 0.0), (0.0, 0.01), (0.0, -0.01)])
def test_growth_is_amortised(dx: float, dy: float):
    grid = OccupancyGrid()
    moves = sum(grid.grow_to_contain((dx * k, dy * k), (dx * k, dy * k)) for k in range(10_000))
    assert moves < 25  # 2000 cells at half again as many each time


@pytest.mark.parametrize("resolution_m", [-0.05, 0.0, math.nan, math.inf])
def test_a_resolution_that_is_no_length_is_refused(resolution_m: float):
    with pytest.raises(ValueError, match="resolution_m"):
        GridConfig(resolution_m=resolution_m)


def test_a_clamp_within_the_thresholds_is_refused():
    with pytest.raises(ValueError, match=r"clamp 0\.5"):
        GridConfig(clamp=0.5)


def test_a_prior_outside_the_unknown_band_is_refused():
    with pytest.raises(ValueError, match="prior"):
        GridConfig(prior=0.8)
