"""Scans kept in little room: what is read back is what was kept, to a tenth of a millimetre."""

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import SlamLocalizer
from occmap.localization.mapped_scans import STEPS, MappedScan, MappedScans, packed_ranges, unpacked_ranges
from occmap.localization.tracked import Tracked
from occmap.scan import Scan
from tests.occmap.localization.drives import RING, RING_LAP, drive, observe

HERE = Tracked(3, Pose2(1.0, 2.0, 0.1), Pose2(0.5, 0.25, -0.1), 0.3)
MOUNT = Pose2(0.1, 0.0, 0.02)


def scan(ranges_m, max_range_m: float = 12.0, min_range_m: float = 0.05, turn_rad: float = 0.0) -> Scan:
    bearings = np.linspace(-math.pi, math.pi, len(ranges_m), endpoint=False) + turn_rad
    return Scan(bearings, np.asarray(ranges_m, np.float64), max_range_m, min_range_m)


def test_from_one_submap_to_the_next_a_pose_goes_without_a_jump():
    submaps = [Pose2.identity(), Pose2(1.0, 0.0, 0.0)]
    for blend, x_m, yaw_rad in ((0.0, 0.5, 0.1), (0.25, 0.55, 0.15), (1.0, 0.7, 0.3)):
        tracked = Tracked(0, Pose2(0.5, 0.0, 0.1), Pose2(-0.3, 0.0, 0.3), blend)
        assert tracked.in_map(submaps).numbers() == pytest.approx((x_m, 0.0, yaw_rad))


@pytest.mark.parametrize("max_range_m", [12.0, 81.83])
def test_ranges_are_kept_to_the_nearest_step(max_range_m: float):
    seen = scan(np.random.default_rng(0).uniform(0.05, max_range_m, 1000), max_range_m)
    kept_m = unpacked_ranges(packed_ranges(seen), max_range_m)
    assert np.abs(kept_m - seen.ranges_m).max() <= 0.5001 * max_range_m / STEPS


def test_a_hit_stays_a_hit_and_what_says_nothing_stays_silent():
    seen = scan([0.05, 0.0500001, math.nextafter(12.0, 0.0), 12.0, 15.0, math.inf, math.nan, 0.02, -1.0])
    kept = scan(unpacked_ranges(packed_ranges(seen), 12.0))
    assert np.array_equal(kept.is_hit, seen.is_hit)
    assert np.isinf(kept.ranges_m).tolist() == [False] * 3 + [True] * 3 + [False] * 3
    assert np.isnan(kept.ranges_m).tolist() == [False] * 6 + [True] * 3


def test_a_scan_kept_again_is_the_same_to_the_last_bit():
    scans = MappedScans()
    scans.append(MappedScan.of(scan(np.linspace(0.1, 13.0, 360)), MOUNT, HERE))
    scans.append(scans[0])
    first, again = scans[0], scans[1]
    assert np.array_equal(first.scan.ranges_m, again.scan.ranges_m)
    assert np.array_equal(first.scan.bearings_rad, again.scan.bearings_rad)
    assert again.tracked == HERE
    assert again.robot_from_lidar == MOUNT
    assert (again.reach_m, again.effort_m) == (first.reach_m, first.effort_m)


def test_bearings_are_kept_once_for_all_scans_that_have_the_same():
    scans = MappedScans()
    for turn_rad in (0.0, 0.0, 0.01, 0.0):
        scans.append(MappedScan.of(scan(np.full(90, 3.0), turn_rad=turn_rad), MOUNT, HERE))
    assert scans[0].scan.bearings_rad is scans[1].scan.bearings_rad
    first_rad = [scans[k].scan.bearings_rad[0] for k in range(4)]
    assert first_rad == pytest.approx([-math.pi, -math.pi, 0.01 - math.pi, -math.pi], abs=1e-6)


def test_what_is_to_be_inserted_is_what_is_kept():
    """So that the map built anew after a correction differs from the one driven by as far as poses do."""
    slam = SlamLocalizer()
    for seen in observe(RING, drive(RING_LAP[:2])[:30], np.random.default_rng(4)):
        told = slam.update(seen)
        if told.insert:
            kept = slam.told.scans[-1].scan
            assert told.scan is not None
            assert np.array_equal(told.scan.ranges_m, kept.ranges_m, equal_nan=True)
            assert np.array_equal(told.scan.bearings_rad, kept.bearings_rad)
    assert len(slam.told.scans) > 10
