import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import OdometryLocalizer
from occmap.scan import Observation, Scan


def _at(odom_from_robot: Pose2) -> Observation:
    return Observation(0.0, odom_from_robot, Scan(np.zeros(1), np.ones(1), 10.0), Pose2.identity())


def test_the_first_observation_is_the_origin_of_the_map():
    start = Pose2(3.0, -2.0, 1.0)
    estimate = OdometryLocalizer().update(_at(start))
    assert estimate.map_from_robot.position == pytest.approx((0.0, 0.0))
    assert estimate.map_from_robot.yaw_rad == pytest.approx(0.0)


def test_odometry_is_repeated_in_the_frame_of_the_first_pose():
    localizer, start, move = OdometryLocalizer(), Pose2(3.0, -2.0, 1.0), Pose2(0.5, 0.1, -0.3)
    localizer.update(_at(start))
    estimate = localizer.update(_at(start @ move))
    assert estimate.map_from_robot.position == pytest.approx(move.position)
    assert estimate.map_from_robot.yaw_rad == pytest.approx(move.yaw_rad)
    assert estimate.insert
    assert estimate.grid is None


def test_beams_cast_on_the_move_are_seen_from_where_the_robot_is():
    """Half a metre in a turn of one second, towards a wall that the first beam still found farther away."""
    localizer, times = OdometryLocalizer(), np.array([-1.0, 0.0])

    def seen(time_s, x_m, ranges):
        scan = Scan(np.zeros(2), np.array(ranges), 10.0, beam_times_s=times)
        return Observation(time_s, Pose2(x_m, 0.0, 0.0), scan, Pose2.identity())

    localizer.update(seen(0.0, 0.0, [3.5, 3.0]))
    scan = localizer.update(seen(1.0, 0.5, [3.0, 2.5])).scan
    assert scan is not None
    assert scan.ranges_m == pytest.approx([2.5, 2.5])
