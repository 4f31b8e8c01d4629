"""The C twin of the kernel benchmark does the same work as the mapper."""

from __future__ import annotations

import math

import numpy as np
import pytest

from experiments.benchmarking.kernels import CTwin, TimedMapper, time_kernels
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig

BEARINGS = np.arange(360) * 2.0 * math.pi / 360


def scans(n: int) -> list[tuple[Scan, Pose2]]:
    rng = np.random.default_rng(0)
    return [
        (Scan(BEARINGS, rng.uniform(1.0, 5.0, 360), 12.0), Pose2(*rng.uniform(-1.0, 1.0, 3)))
        for _ in range(n)
    ]


def test_the_c_twin_and_the_mapper_fill_the_same_map():
    twin = CTwin.compiled()
    if twin is None:
        pytest.skip("no C compiler here")
    mapper = TimedMapper(SensorModelConfig(hit_log_odds=0.01, miss_log_odds=-0.005))  # far from the clamp
    grid = OccupancyGrid()
    grid.grow_to_contain((-8.0, -8.0), (8.0, 8.0))
    for scan, pose in scans(3):
        mapper.insert(scan, pose, grid)
        assert twin.integrate(mapper, grid) > 0.0
    np.testing.assert_allclose(twin.log_odds, grid.log_odds, atol=1e-4)


def test_times_are_those_of_every_stage():
    times = time_kernels(scans(20), extent_m=30.0)
    assert times.cells == 601 * 601
    assert times.insert_us > times.integration_us > 0.0
    assert min(times.clearance_us, times.frontiers_us, times.clusters_us) > 0.0
    if times.c_twin_us is not None:
        assert times.integration_over_c == times.integration_us / times.c_twin_us
