"""From a config to a robot in a building."""

import pytest

from experiments.config import ExperimentConfig
from experiments.experiment import prepare
from sim.generators import BuildingConfig
from sim.lidar import LidarConfig
from sim.robot import RobotConfig


def test_the_mind_knows_the_body_that_it_drives_from_one_source():
    config = ExperimentConfig(
        building=BuildingConfig(kind="apartment"),
        robot=RobotConfig(max_linear_mps=0.8, max_angular_accel_radps2=2.0),
        lidar=LidarConfig(rate_hz=5.0),
    )
    experiment = prepare(config)
    body = experiment.explorer.body
    assert experiment.explorer.planner.body is experiment.explorer.follower.body is body
    assert body.radius_m == experiment.robot.world.body_radius_m
    assert (body.max_speed_mps, body.turn_acceleration_radps2) == (0.8, 2.0)
    assert body.period_s == pytest.approx(0.2)
