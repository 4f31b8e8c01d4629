import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization.undistortion import undistorted
from occmap.scan import Scan


def _turning_scan(step: Pose2, step_s: float, wall_x_m: float = 3.0) -> tuple[Scan, Scan]:
    """A wall at x = wall_x_m, cast beam by beam from a moving robot, and cast at once from where it ended."""
    bearings = np.linspace(-0.6, 0.6, 61)
    times = np.linspace(-step_s, 0.0, 61)
    moving = []
    for bearing, time in zip(bearings, times, strict=True):
        share = time / step_s
        turn = share * step.yaw_rad
        half = 0.5 * (turn - step.yaw_rad)
        at = (share * (math.cos(half) * step.x_m), share * (math.sin(half) * step.x_m))
        moving.append((wall_x_m - at[0]) / math.cos(bearing + turn))
    return (
        Scan(bearings, np.array(moving), 12.0, beam_times_s=times),
        Scan(bearings, wall_x_m / np.cos(bearings), 12.0),
    )


@pytest.mark.parametrize("step", [Pose2(0.05, 0.0, 0.0), Pose2(0.0, 0.0, 0.15), Pose2(0.05, 0.004, 0.15)])
def test_a_wall_seen_on_the_move_is_straight_again(step):
    scan, _ = _turning_scan(step, 0.1)
    bent = np.ptp(scan.ranges_m * np.cos(scan.bearings_rad))
    straight = undistorted(scan, Pose2.identity(), step, 0.1)
    x = straight.ranges_m * np.cos(straight.bearings_rad)
    assert np.ptp(x) < 0.02 * bent + 1e-3
    assert x.mean() == pytest.approx(3.0, abs=2e-3)


def test_what_met_nothing_stays_so():
    times = np.array([-0.1, -0.05, 0.0])
    scan = Scan(np.array([-0.1, 0.0, 0.1]), np.array([np.inf, np.nan, 2.0]), 12.0, beam_times_s=times)
    ranges = undistorted(scan, Pose2(0.1, 0.0, 0.0), Pose2(0.05, 0.0, 0.1), 0.1).ranges_m
    assert np.isinf(ranges[0])
    assert np.isnan(ranges[1])
    assert ranges[2] == pytest.approx(2.0)


def test_what_says_nothing_is_not_moved_to_where_it_would():
    """Zeros and what is too near would become obstacles, what is too far a ring of walls."""
    ranges_m = np.array([0.0, -np.inf, 0.04, 12.0, 13.0, 11.999, 0.051])
    times_s = np.linspace(-0.1, -0.01, len(ranges_m))
    scan = Scan(np.linspace(-0.1, 0.1, len(ranges_m)), ranges_m, 12.0, 0.05, times_s)
    for step in (Pose2(0.3, 0.0, 0.1), Pose2(-0.3, 0.0, 0.1)):
        moved = undistorted(scan, Pose2.identity(), step, 0.1)
        assert moved.is_hit.tolist() == scan.is_hit.tolist()
        assert np.isnan(moved.ranges_m[:3]).all()
        assert np.isinf(moved.ranges_m[3:5]).all()


def test_without_beam_times_nothing_changes():
    scan = Scan(np.zeros(1), np.ones(1), 12.0)
    assert undistorted(scan, Pose2.identity(), Pose2(0.1, 0.0, 0.1), 0.1) is scan
