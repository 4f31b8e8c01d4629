"""Laws of clouds: a scan's hits beside a NumPy twin, walls between them, and rasters made when asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization.submap import Submap, SubmapConfig
from occmap.localization.surfel_map import BRIDGE_SPACING_M, Cloud, PackedSurfels
from occmap.scan import Scan

BEARINGS = np.linspace(-math.pi, math.pi, 90, endpoint=False)
MOUNT = Pose2(0.1, -0.05, 0.3)


def scan(seed: int) -> Scan:
    """Of a round room of 5 m, with all that can become of a beam."""
    rng = np.random.default_rng(seed)
    ranges = 5.0 + 0.01 * rng.standard_normal(len(BEARINGS))
    ranges[rng.integers(0, len(BEARINGS), 12)] = np.repeat([np.nan, np.inf, 0.01, 11.0], 3)
    return Scan(BEARINGS, ranges, 12.0, 0.05)


@pytest.mark.parametrize("seed", range(5))
def test_a_cloud_is_what_the_beams_met_within_reach(seed):
    seen, cloud = scan(seed), Cloud.of(scan(seed), MOUNT, 8.0)
    hit = seen.is_hit & (seen.ranges_m < 8.0)
    away = np.column_stack((np.cos(BEARINGS + MOUNT.yaw_rad), np.sin(BEARINGS + MOUNT.yaw_rad)))
    np.testing.assert_array_equal(cloud.beams, np.flatnonzero(hit))
    np.testing.assert_allclose(cloud.points, away[hit] * seen.ranges_m[hit, None] + MOUNT.position)
    np.testing.assert_allclose(cloud.facing, -away[hit])


def test_walls_run_between_neighbours_wherever_the_cloud_is_moved():
    cloud = Cloud.of(scan(1), MOUNT, 8.0)
    a_from_b = Pose2(3.0, -2.0, 1.0)
    walls = cloud.walls()
    assert len(walls.points) > 3 * len(cloud.points)
    np.testing.assert_allclose(walls.points[: len(cloud.points)], cloud.points)
    moved = cloud.moved(a_from_b).walls()
    np.testing.assert_allclose(moved.points, a_from_b.apply(walls.points), atol=1e-9)
    away = walls.points - MOUNT.position
    assert np.median(5.0 * np.diff(np.sort(np.arctan2(*away.T)))) < BRIDGE_SPACING_M
    np.testing.assert_allclose(walls.facing, -away / np.hypot(*away.T)[:, None], atol=0.01)
    assert len(walls.walls().points) == len(walls.points)


def test_a_raster_is_the_same_whenever_it_is_asked_for():
    early, late = (Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0) for _ in range(2))
    for seed in range(4):
        cloud, pose = Cloud.of(scan(seed), MOUNT, 30.0), Pose2(0.1 * seed, 0.0, 0.05 * seed)
        for submap in (early, late):
            submap.insert(cloud, pose)
        assert early.raster.buffer.any()
    np.testing.assert_array_equal(early.raster.buffer, late.raster.buffer)


def test_surfels_are_packed_to_half_a_milliradian_and_in_two_thirds_of_the_room():
    rng = np.random.default_rng(3)
    angles = rng.uniform(-math.pi, math.pi, (2, 500))
    rows = np.column_stack(
        (
            *(rng.uniform(-60.0, 60.0, (2, 500))),
            *(np.cos(angles[0]), np.sin(angles[0]), rng.uniform(-1.0, 1.0, 500)),
            *(rng.integers(1, 2048, 500), np.cos(angles[1]), np.sin(angles[1])),
        )
    ).astype(np.float32)
    packed = PackedSurfels.of(rows)
    assert packed.means.nbytes + packed.others.nbytes < 0.65 * rows.nbytes
    for exact in (0, 1, 5):
        np.testing.assert_array_equal(packed.rows[:, exact], rows[:, exact])
    np.testing.assert_allclose(packed.rows, rows, atol=5e-4)
