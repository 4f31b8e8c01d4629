"""A base that does what it is told, within its limits, and the same each time."""

from __future__ import annotations

import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from occmap.geometry import Pose2, Twist2, wrap_angle
from sim.lidar import LidarConfig
from sim.robot import RobotConfig
from tests.sim.rooms import robot_in, room

BIG = room(20.0, 20.0, Pose2(4.0, 10.0, 0.0))


def drive(robot, twist: Twist2, seconds: float) -> None:
    for _ in range(round(seconds * 10)):
        robot.act(twist)


def test_straight_ahead_is_straight():
    robot = robot_in(BIG)
    drive(robot, Twist2(0.5, 0.0), 20.0)
    truth = robot.truth()
    assert truth.world_from_robot.x_m - 4.0 == pytest.approx(0.5 * (20.0 - 0.25), rel=0.003)
    assert truth.world_from_robot.y_m == pytest.approx(10.0, abs=1e-3)
    assert truth.path_length_m == pytest.approx(truth.world_from_robot.x_m - 4.0, abs=1e-6)
    assert truth.twist.linear_mps == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize("rate", [1.5, -1.5])
def test_turning_on_the_spot_turns_as_told_and_stays_there(rate):
    robot = robot_in(BIG)
    drive(robot, Twist2(0.0, rate), 10.0)
    turned = math.copysign(1.5 * (10.0 - 0.25), rate)
    error = wrap_angle(robot.truth().world_from_robot.yaw_rad - turned)
    assert abs(error) < 0.01 * abs(turned)
    assert robot.truth().world_from_robot.distance_to(BIG.start) < 0.002


def test_an_arc_has_the_radius_it_was_asked_for():
    robot = robot_in(BIG)
    drive(robot, Twist2(0.4, 0.4), 0.5)
    began = robot.truth().world_from_robot
    drive(robot, Twist2(0.4, 0.4), math.pi / 0.4)  # half a circle of radius 1 m
    assert robot.truth().world_from_robot.distance_to(began) == pytest.approx(2.0, abs=0.02)


def test_commands_are_limited_and_ramped():
    robot = robot_in(BIG)
    speeds = []
    for _ in range(20):
        robot.act(Twist2(9.0, 0.0))
        speeds.append(robot.truth().twist.linear_mps)
    steps = [later - sooner for sooner, later in pairwise(speeds)]
    assert max(steps) < 0.115  # 1 m/s² for a tenth of a second
    assert speeds[-1] == pytest.approx(0.5, rel=0.01)


def test_time_passes_by_whole_scans():
    robot = robot_in(BIG)
    drive(robot, Twist2.zero(), 30.0)
    assert robot.time_s == 30.0
    assert robot.sense().time_s == 30.0


def test_clearance_is_from_the_body_to_the_nearest_wall():
    robot = robot_in(room(4.0, 3.0, Pose2(1.0, 1.2, 0.4)))
    assert robot.truth().clearance_m == pytest.approx(1.0 - 0.17, abs=1e-6)
    assert robot_in(BIG).truth().clearance_m == pytest.approx(4.0 - 0.17, abs=1e-6)


@pytest.mark.parametrize("mistake", [{"max_linear_mps": 0.0}, {"control_hz": math.nan}])
def test_nonsense_is_refused_with_its_value(mistake):
    with pytest.raises(ValueError, match=str(next(iter(mistake.values())))):
        RobotConfig(**mistake)


def test_limits_that_the_wheels_cannot_reach_are_refused():
    robot_in(BIG, config=RobotConfig(max_linear_mps=1.5, max_angular_radps=3.0))
    for linear, angular in ((2.0, 1.5), (0.5, 20.0)):
        fast = RobotConfig(max_linear_mps=linear, max_angular_radps=angular)
        with pytest.raises(
            ValueError, match=f"max_linear_mps {linear} with max_angular_radps {angular} turns"
        ):
            robot_in(BIG, config=fast)


def test_a_rate_that_does_not_divide_the_physics_steps_is_refused():
    with pytest.raises(ValueError, match=r"rate_hz must divide the 200 physics steps a second, got 7"):
        robot_in(BIG, lidar=LidarConfig(rate_hz=7.0))


STORY = """
import hashlib
from occmap.geometry import Pose2, Twist2
from sim.building import Cylinder
from sim.lidar import LidarConfig
from tests.sim.rooms import robot_in, room

building = room(4.0, 3.0, Pose2(1.0, 1.2, 0.4), (Cylinder(3.0, 1.5, 0.1),))
robot = robot_in(building, lidar=LidarConfig(), seed=5)
digest = hashlib.sha256()
for step in range(100):
    seen = robot.sense()
    digest.update(seen.scan.ranges_m.tobytes())
    digest.update(repr((seen.odom_from_robot, robot.truth())).encode())
    robot.act(Twist2(0.4, 0.8 if step % 30 < 15 else -0.5))
print(digest.hexdigest())
"""


def test_the_same_seed_is_the_same_run_bit_for_bit_in_another_process():
    runs = [
        subprocess.run(
            [sys.executable, "-c", STORY],
            capture_output=True,
            text=True,
            check=True,
            cwd=Path(__file__).parents[2],
        ).stdout
        for _ in range(2)
    ]
    assert runs[0] == runs[1]
    assert len(runs[0].strip()) == 64


def test_configs_come_without_mujoco():
    code = (
        "import sys, sim.robot, sim.lidar, sim.lidar_noise, sim.odometry, sim.faults; "
        "sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2]).returncode == 0
