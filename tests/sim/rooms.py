"""Small worlds for tests, and robots to put into them."""

from __future__ import annotations

import numpy as np

from occmap.geometry import Pose2
from sim.building import Box, Building, Door, Solid
from sim.faults import FaultsConfig
from sim.lidar import Lidar, LidarConfig
from sim.lidar_noise import LidarNoiseConfig, LidarStreams
from sim.odometry import Odometry, OdometryConfig
from sim.robot import Robot, RobotConfig
from sim.world import World

EXACT = LidarConfig(noise=LidarNoiseConfig().scaled(0.0))


def room(
    width_m: float,
    height_m: float,
    start: Pose2,
    solids: tuple[Solid, ...] = (),
    doors: tuple[Door, ...] = (),
) -> Building:
    """A rectangle whose inner walls stand at 0 and at its width and height."""
    w, h, half = 0.5 * width_m, 0.5 * height_m, 0.05
    walls = (
        Box(w, -half, w + 2 * half, half),
        Box(w, height_m + half, w + 2 * half, half),
        Box(-half, h, half, h),
        Box(width_m + half, h, half, h),
    )
    return Building("room", "test", (0.0, 0.0), (width_m, height_m), walls + solids, start, doors=doors)


def robot_in(
    building: Building,
    *,
    lidar: LidarConfig = EXACT,
    odometry: OdometryConfig | None = None,
    faults: FaultsConfig | None = None,
    config: RobotConfig | None = None,
    seed: int = 0,
) -> Robot:
    """A robot at the building's start; by default its lidar is exact and its odometry is not."""
    world = World(building, faults)
    lidar_rng, odometry_rng = np.random.default_rng(seed).spawn(2)
    beams = Lidar(world, LidarStreams.spawned(lidar_rng), lidar)
    return Robot(world, beams, Odometry(world, odometry_rng, odometry), config)
