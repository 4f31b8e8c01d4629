"""From a config to a robot in a building."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.config import ExperimentConfig, ExplorerOptions
from experiments.experiment import boundary_in_map, prepare
from occmap.geometry import Pose2
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


def test_what_is_outside_of_a_boundary_does_not_count():
    whole = ExperimentConfig(building=BuildingConfig(kind="apartment", seed=1))
    robot = prepare(whole).robot
    x, y = robot.world.world_from_robot.position
    square = ((x - 2.0, y - 2.0), (x + 2.0, y - 2.0), (x + 2.0, y + 2.0), (x - 2.0, y + 2.0))
    part = prepare(replace(whole, boundary=square))
    assert 0.0 < part.scorer.explorable_area_m2 <= 16.0 < prepare(whole).scorer.explorable_area_m2
    corners = part.world_from_map.apply(np.array(part.explorer.config.boundary_in_map))
    np.testing.assert_allclose(corners, square, atol=1e-9)


def test_a_boundary_without_the_start_is_told_where_that_is():
    beside = ExperimentConfig(boundary=((1.0, 0.0), (2.0, 0.0), (2.0, 1.0)))
    with pytest.raises(ValueError, match=r"the start, \(0.00, 3.00\)"):
        boundary_in_map(beside, Pose2(-0.001, 3.0, 0.0))


def test_a_boundary_that_the_score_would_not_know_of_is_refused():
    corners = ((-1.0, -1.0), (1.0, -1.0), (0.0, 1.0))
    with pytest.raises(ValueError, match="give that instead"):
        ExperimentConfig(explorer=ExplorerOptions(boundary_in_map=corners))
