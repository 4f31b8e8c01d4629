"""How fast the world runs without a mind: physics, lidar and control alone."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from occmap.geometry import Twist2
from occmap.scan import Scan
from sim.building import Building
from sim.lidar import Lidar
from sim.lidar_noise import LidarStreams
from sim.odometry import Odometry
from sim.robot import Robot
from sim.world import World

DURATION_S = 60.0
"""Simulated."""


@dataclass(frozen=True)
class SimSpeed:
    """Cost of a simulated second, in CPU milliseconds on one core."""

    solids: int
    sense_ms: float
    """Rays and noise."""
    act_ms: float
    """Physics, wheel control and odometry."""
    truth_ms: float
    """The true state, read once a scan."""

    @property
    def sim_seconds_per_cpu_second(self) -> float:
        """How many times faster than real time the world runs alone."""
        return 1e3 / (self.sense_ms + self.act_ms + self.truth_ms)


def benchmark_sim(building: Building) -> SimSpeed:
    """Let a robot wander about a building by a rule that costs next to nothing."""
    world = World(building)
    robot = Robot(
        world,
        Lidar(world, LidarStreams.spawned(np.random.default_rng(0))),
        Odometry(world, np.random.default_rng(1)),
    )
    sense_s = act_s = truth_s = 0.0
    while robot.time_s < DURATION_S:
        began = time.process_time()
        scan = robot.sense().scan
        sensed = time.process_time()
        twist = wander(scan)
        thought = time.process_time()
        robot.act(twist)
        acted = time.process_time()
        robot.truth()
        sense_s, act_s, truth_s = (
            sense_s + sensed - began,
            act_s + acted - thought,
            truth_s + time.process_time() - acted,
        )
    ms = 1e3 / robot.time_s
    return SimSpeed(len(building.solids), sense_s * ms, act_s * ms, truth_s * ms)


def wander(scan: Scan) -> Twist2:
    """Ahead while there is room, else turn left until there is."""
    ahead = np.abs(scan.bearings_rad) < 0.6
    blocked = np.nanmin(scan.ranges_m[ahead], initial=scan.max_range_m) < 0.6
    return Twist2(0.0, 1.0) if blocked else Twist2(0.5, 0.0)
