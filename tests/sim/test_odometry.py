"""Encoders that are perfect follow the truth; encoders that are not drift as far as they are said to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2, Twist2, wrap_angle
from sim.odometry import Odometry, OdometryConfig, TrueOdometry, arc
from sim.world import World
from tests.sim.rooms import robot_in, room

START = Pose2(4.0, 10.0, 0.5)
BIG = room(20.0, 20.0, START)
PERFECT = OdometryConfig().scaled(0.0)


class Wheels:
    """Stands in for a world: wheels that have turned so far."""

    wheel_radius_m, track_m = 0.05, 0.26
    wheel_angles_rad = (0.0, 0.0)


def drift(config: OdometryConfig, seed: int, twist: Twist2 = Twist2(0.5, 0.0)) -> tuple[float, float, float]:  # noqa: B008
    """Metres off, radians off and metres gone after half a minute."""
    robot = robot_in(BIG, odometry=config, seed=seed)
    for _ in range(200):
        robot.act(twist)
    believed = START @ robot.sense().odom_from_robot
    true = robot.truth().world_from_robot
    return (
        believed.distance_to(true),
        abs(wrap_angle(believed.yaw_rad - true.yaw_rad)),
        robot.truth().path_length_m,
    )


def test_it_begins_at_the_identity():
    assert robot_in(BIG).sense().odom_from_robot == Pose2.identity()


def test_an_arc_is_the_motion_of_two_wheels():
    assert arc(1.0, 1.0, 0.26) == Pose2(1.0, 0.0, 0.0)
    spin = arc(-0.13, 0.13, 0.26)
    assert (spin.x_m, spin.y_m, spin.yaw_rad) == pytest.approx((0.0, 0.0, 1.0))
    quarter = arc((2.0 - 0.13) * math.pi / 2, (2.0 + 0.13) * math.pi / 2, 0.26)
    assert (quarter.x_m, quarter.y_m, quarter.yaw_rad) == pytest.approx((2.0, 2.0, math.pi / 2))


def test_perfect_encoders_hardly_drift():
    robot = robot_in(BIG, odometry=PERFECT)
    rng = np.random.default_rng(2)
    for _ in range(40):
        twist = Twist2(rng.uniform(0.1, 0.5), rng.uniform(-1.5, 1.5))
        for _ in range(10):
            robot.act(twist)
    believed, true = START @ robot.sense().odom_from_robot, robot.truth().world_from_robot
    assert robot.truth().path_length_m > 10.0
    assert believed.distance_to(true) < 0.05
    assert abs(wrap_angle(believed.yaw_rad - true.yaw_rad)) < math.radians(0.5)


def test_default_drift_shows_and_stays_within_what_the_wheels_allow():
    runs = [drift(OdometryConfig(), seed) for seed in range(8)]
    for metres, radians, gone in runs:
        worst_turn = 2 * 0.005 * gone / (0.26 * 0.99)  # one wheel too large, the other too small
        assert radians < worst_turn + math.radians(4.0)  # tick noise: a few times 0.5 degrees a root metre
        assert metres < gone * worst_turn
    assert np.median([metres for metres, _, _ in runs]) > 0.1


def test_each_systematic_error_does_what_it_should():
    turning = Twist2(0.0, 1.0)
    only_track = OdometryConfig(radius_error=0.0, tick_noise=0.0)
    only_radius = OdometryConfig(track_error=0.0, tick_noise=0.0)
    _, straight_rad, _ = drift(only_track, 0)
    _, turning_rad, _ = drift(only_track, 0, turning)
    assert straight_rad < math.radians(0.2)
    assert 0.0 < turning_rad < 0.0102 * 20.0
    assert drift(only_radius, 0)[1] > drift(PERFECT, 0)[1]


def test_scaling_one_error_leaves_the_chances_of_the_others_alone():
    def turned_rad(radius_error: float, track_error: float) -> float:
        wheels = Wheels()
        config = OdometryConfig(radius_error=radius_error, track_error=track_error, tick_noise=0.0)
        odometry = Odometry(wheels, np.random.default_rng(7), config)  # type: ignore[arg-type]
        wheels.wheel_angles_rad = (20.0, 20.0)
        return odometry.read(wheels).yaw_rad  # type: ignore[arg-type]

    once = turned_rad(0.005, 0.0)
    assert turned_rad(0.01, 0.0) == pytest.approx(2.0 * once)
    assert turned_rad(0.005, 0.01) == pytest.approx(once, rel=0.011)


def test_ticks_are_whole_and_none_is_lost():
    wheels = Wheels()
    odometry = Odometry(wheels, np.random.default_rng(0), PERFECT)  # type: ignore[arg-type]
    for turned in np.linspace(0.0, 40 * math.pi, 997):
        wheels.wheel_angles_rad = (float(turned), float(turned))
        odometry.read(wheels)  # type: ignore[arg-type]
    pose = odometry.read(wheels)  # type: ignore[arg-type]
    assert pose.x_m == pytest.approx(40 * math.pi * 0.05, abs=2 * math.pi * 0.05 / 1024)
    assert pose.yaw_rad == 0.0


def test_true_odometry_is_the_truth_seen_from_the_start():
    world = World(BIG)
    odometry = TrueOdometry(world)
    assert odometry.read(world).distance_to(Pose2.identity()) < 1e-9
    world.drive(10.0, 12.0)
    world.advance(200)
    back = START @ odometry.read(world)
    assert back.distance_to(world.world_from_robot) < 1e-9


@pytest.mark.parametrize(
    "mistake", [{"radius_error": -0.1}, {"track_error": 1.5}, {"ticks_per_turn": 0}, {"tick_noise": -1.0}]
)
def test_nonsense_is_refused_with_its_value(mistake):
    with pytest.raises(ValueError, match=str(next(iter(mistake.values())))):
        OdometryConfig(**mistake)
