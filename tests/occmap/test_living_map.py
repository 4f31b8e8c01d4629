"""Layers of a large map begin anew in slices, where the robot is first, and end up as if built at once."""

import numpy as np
import pytest

from occmap import living_map
from occmap.clearance import ClearanceConfig, ClearanceMap
from occmap.frontiers import FrontierConfig, FrontierMap
from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.living_map import LivingMap, bands_around
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig
from occmap.stopwatch import Stopwatch


def fresh_map() -> LivingMap:
    return LivingMap(GridConfig(0.1), SensorModelConfig(), ClearanceConfig(), FrontierConfig())


def scan_of(rng: np.random.Generator) -> Scan:
    bearings = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    return Scan(bearings, rng.uniform(2.0, 6.0) + rng.normal(0.0, 0.3, 180), 12.0)


def drive(to: LivingMap, scans: int, rng: np.random.Generator, step_m: float = 1.0) -> None:
    for k in range(scans):
        to.settle()
        to.insert(scan_of(rng), Pose2(step_m * k, 0.3 * k, 0.1 * k), Stopwatch())


def assert_layers_fit(living: LivingMap) -> None:
    clearance, edges = ClearanceMap(), FrontierMap()
    clearance.rebuild(living.grid)
    edges.rebuild(living.grid)
    np.testing.assert_array_equal(living.clearance_m, clearance.distance_m)
    np.testing.assert_array_equal(living.frontier_mask, edges.mask)


@pytest.mark.parametrize("cells", [700, 3_000])
def test_a_map_that_grows_in_slices_is_as_one_built_at_once(monkeypatch, cells: int):
    monkeypatch.setattr(living_map, "CELLS_PER_TURN", cells)
    living, settled = fresh_map(), 0
    rng = np.random.default_rng(0)
    for k in range(60):  # a robot goes on while the layers follow
        settled += living.is_settling
        living.settle()
        living.insert(scan_of(rng), Pose2(0.4 * k, 0.1 * k, 0.1 * k), Stopwatch())
    assert settled > 5
    while living.is_settling:
        living.settle()
    assert_layers_fit(living)
    grouped = np.concatenate([frontier.cells for frontier in living.find_frontiers()])
    assert sorted(map(tuple, grouped)) == sorted(map(tuple, np.argwhere(living.frontier_mask)[:, ::-1]))


def test_another_grid_is_in_order_at_once_where_the_robot_is(monkeypatch):
    monkeypatch.setattr(living_map, "CELLS_PER_TURN", 12_000)
    other, living = fresh_map(), fresh_map()
    drive(other, 30, np.random.default_rng(1))
    here = Pose2(29.0, 8.7, 0.0)
    living.replace(other.grid, here)
    assert living.is_settling
    row = other.grid.frame.cell_at(*here.position)[1]
    expected = ClearanceMap()
    expected.rebuild(other.grid)
    np.testing.assert_array_equal(living.clearance_m[row], expected.distance_m[row])
    turns = 0
    while living.is_settling:
        living.settle()
        turns += 1
    assert turns > 3
    assert_layers_fit(living)


def test_a_small_map_is_renewed_within_the_turn():
    living, other = fresh_map(), fresh_map()
    drive(other, 5, np.random.default_rng(2))
    living.replace(other.grid, Pose2.identity())
    assert not living.is_settling
    assert_layers_fit(living)


@pytest.mark.parametrize("row", [-5, 0, 3, 50, 96, 99, 200])
def test_bands_cover_every_row_once_and_the_nearest_come_first(monkeypatch, row: int):
    monkeypatch.setattr(living_map, "CELLS_PER_TURN", 500)
    bands = bands_around(row, (100, 40))
    assert sorted(k for band in bands for k in range(band.start, band.stop)) == list(range(100))
    near = min(max(row, 0), 99)
    assert bands[0].start <= near < bands[0].stop
    gaps = [max(band.start - near, near - band.stop + 1, 0) for band in bands]
    assert gaps == sorted(gaps)
    assert bands_around(0, OccupancyGrid().shape) == [slice(0, 0)]
