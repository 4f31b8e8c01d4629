"""The way of a robot whose wheels say nothing is the localizer's."""

from __future__ import annotations

from dataclasses import replace

import pytest

from occmap.geometry import Pose2
from occmap.scan import Observation
from occmap.silent_odometry import SilentOdometry
from tests.scans import AHEAD, beams

STANDS = Pose2(7.0, -3.0, 1.0)


def seen(odom_from_robot: Pose2) -> Observation:
    return Observation(0.0, odom_from_robot, beams(AHEAD, [1.0]), Pose2.identity())


def way(silent: SilentOdometry, here: Pose2, odom_from_robot: Pose2 = STANDS) -> tuple[float, float, float]:
    """From STANDS to where the robot is told to be."""
    return (STANDS.inverse() @ silent.made_up_for(seen(odom_from_robot), here).odom_from_robot).numbers()


@pytest.mark.parametrize("to", [Pose2(0.5, 0.0, 0.1), Pose2(0.0, 0.0, -0.3)])
def test_where_odometry_always_stands_the_localizer_tells_the_way(to):
    silent, start = SilentOdometry(), Pose2(-2.0, 4.0, 0.7)
    assert way(silent, start) == pytest.approx((0.0, 0.0, 0.0))
    assert way(silent, start @ to) == pytest.approx(to.numbers())
    assert way(silent, start) == pytest.approx((0.0, 0.0, 0.0))


def test_what_standing_robots_are_seen_to_do_is_noise():
    silent = SilentOdometry()
    for off_m in (0.0, 0.03, -0.05, 0.09):
        assert way(silent, Pose2(off_m, 0.0, 0.0)) == pytest.approx((0.0, 0.0, 0.0))


def test_odometry_that_says_something_is_handed_on_as_it_is():
    silent, ahead = SilentOdometry(), Pose2(0.3, 0.0, 0.0)
    way(silent, Pose2.identity())
    way(silent, ahead)
    told = seen(STANDS @ Pose2(0.001, 0.0, 0.0))
    assert silent.made_up_for(told, ahead) is told
    assert silent.made_up_for(replace(told, time_s=1.0), ahead).odom_from_robot is told.odom_from_robot


def test_a_correction_of_the_map_is_no_way():
    silent, ahead = SilentOdometry(), Pose2(0.3, 0.0, 0.0)
    way(silent, Pose2.identity())
    before, shift = way(silent, ahead), Pose2(1.0, 2.0, 0.5)
    silent.carry_over(shift)
    assert way(silent, shift @ ahead) == pytest.approx(before)
