"""From a config to a robot in a building, ready for its first scan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.allocator import give_back_large_blocks
from experiments.boundary_cells import cells_within
from experiments.config import ExperimentConfig
from experiments.outcome import Outcome
from experiments.recorders.setting import Setting
from experiments.scoring import Scorer
from experiments.streams import Streams
from occmap.body import Body
from occmap.boundary import are_within, polygon
from occmap.explorer import Explorer
from occmap.geometry import Pose2
from occmap.localization import Localizer, OdometryLocalizer, SlamLocalizer
from occmap.stopwatch import Stopwatch
from sim.building import Building
from sim.generators import generate
from sim.lidar import Lidar
from sim.lidar_noise import LidarStreams
from sim.odometry import Odometer, Odometry, TrueOdometry
from sim.robot import Robot
from sim.starts import with_start
from sim.truth import (
    LIDAR_HEIGHT_M,
    Mask,
    TruthGrid,
    building_summary,
    clearance_m,
    explorable,
    reachable,
    truth_grid,
)
from sim.world import World


@dataclass(frozen=True)
class Experiment:
    """A robot about to explore, and what the truth is."""

    config: ExperimentConfig
    building: Building
    robot: Robot
    explorer: Explorer
    scorer: Scorer
    building_summary: dict[str, Any]
    stopwatch: Stopwatch

    @property
    def world_from_map(self) -> Pose2:
        """The true start: the map's frame is the robot's pose at its first scan."""
        return self.scorer.world_from_map

    @property
    def setting(self) -> Setting:
        """What recorders need to know beforehand."""
        return Setting(self.building, self.world_from_map, self.robot.world.closing)

    def scorer_at_the_end(self, outcome: Outcome) -> Scorer:
        """The scorer to judge a last word by: a closed world offers only what can still be reached."""
        if outcome is not Outcome.SEALED_IN:
            return self.scorer
        world = self.robot.world
        truth = truth_grid(self.building, self.scorer.truth.resolution_m, closed_doors(world))
        return Scorer(truth, in_sight(self.config, truth, world), self.world_from_map)


def prepare(config: ExperimentConfig) -> Experiment:
    """Build everything. ValueError for what cannot be, before anything is simulated."""
    give_back_large_blocks()
    stopwatch = Stopwatch()
    streams = Streams(config.seed)
    with stopwatch.lap("building"):
        building = make_building(config)
        if config.faults.close_doors_at_s is not None and not building.doors:
            raise ValueError(f"close_doors_at_s, but {building.name!r} has no doors: leave it out")
        robot = make_robot(config, building, streams)
    explorer = make_explorer(config, robot)
    with stopwatch.lap("truth"):
        truth = truth_grid(building, config.explorer.grid.resolution_m)
        scorer = Scorer(truth, in_sight(config, truth, robot.world), robot.world.world_from_robot)
        facts = building_summary(building, truth)
    return Experiment(config, building, robot, explorer, scorer, facts, stopwatch)


def in_sight(config: ExperimentConfig, truth: TruthGrid, world: World) -> Mask:
    """What the robot could come to see from where it is."""
    within = cells_within(config.boundary, truth)
    return explorable(truth, world.world_from_robot, world.body_radius_m, config.lidar.max_range_m, within)


def floor_in_reach(config: ExperimentConfig, truth: TruthGrid, start: Pose2, body_radius_m: float) -> Mask:
    """Where some part of the robot's body could come to stand, from a start."""
    within = cells_within(config.boundary, truth)
    places = reachable(truth, start, body_radius_m, within)
    return clearance_m(places, truth.resolution_m) <= body_radius_m


def closed_doors(world: World) -> list[int]:
    """The numbers of the doors that stand in the lidar's way now."""
    if world.faults.close_doors_at_s is None:
        return []
    numbers = world.faults.close_doors or range(len(world.building.doors))
    heights_m = world.doors.height_m
    return [number for number, height_m in zip(numbers, heights_m, strict=True) if height_m > LIDAR_HEIGHT_M]


def make_building(config: ExperimentConfig) -> Building:
    """The plan, or a generated building; entered where the config says, else by the building's seed."""
    streams = Streams(config.building_seed)
    start = None if config.start is None else Pose2(*config.start)
    if config.plan is not None:
        from sim.plan_images import load_plan  # reads images: only where there is one

        return load_plan(config.plan, streams.generator("start"), config.plan_resolution_m, start)
    if config.plan_resolution_m is not None:
        raise ValueError("plan_resolution_m is the size of a plan's pixels: give the --plan too")
    building = generate(config.building, streams.generator("building"))
    return building if start is None else with_start(building, start)


def make_robot(config: ExperimentConfig, building: Building, streams: Streams) -> Robot:
    """A robot with its lidar and odometry, each with its own streams of chance."""
    world = World(building, config.faults)
    noise = streams.child("lidar")
    lidar_streams = LidarStreams(
        range_error=noise.generator("range_error"),
        dropout=noise.generator("dropout"),
        short=noise.generator("short"),
        miss=noise.generator("miss"),
    )
    odometer: Odometer
    if config.pose == "truth":
        odometer = TrueOdometry(world)
    else:
        odometer = Odometry(world, streams.generator("odometry"), config.scaled_odometry)
    return Robot(world, Lidar(world, lidar_streams, config.scaled_lidar), odometer, config.robot)


def make_explorer(config: ExperimentConfig, robot: Robot) -> Explorer:
    """The mind, told of the body that it drives."""
    limits = robot.config
    body = Body(
        radius_m=robot.world.body_radius_m,
        max_speed_mps=limits.max_linear_mps,
        max_turn_radps=limits.max_angular_radps,
        acceleration_mps2=limits.max_linear_accel_mps2,
        turn_acceleration_radps2=limits.max_angular_accel_radps2,
        period_s=1.0 / robot.lidar.config.rate_hz,
    )
    explorer = config.explorer
    if config.boundary:
        explorer = replace(explorer, boundary_in_map=boundary_in_map(config, robot.world.world_from_robot))
    return Explorer(explorer, make_localizer(config), body)


def boundary_in_map(config: ExperimentConfig, start: Pose2) -> tuple[tuple[float, float], ...]:
    """The corners of the polygon as the robot is told of them: in the frame of its start."""
    corners = polygon(config.boundary)
    x_m, y_m = start.position
    if not are_within(corners, np.array([[x_m, y_m]]))[0]:
        raise ValueError(
            f"the boundary must hold the start, ({x_m:z.2f}, {y_m:z.2f}): give others, or a --start within"
        )
    return tuple((x, y) for x, y in start.inverse().apply(corners).tolist())


def make_localizer(config: ExperimentConfig) -> Localizer:
    """Who tells the explorer where it is. With the true pose handed in as odometry, it is believed."""
    if config.pose == "slam":
        return SlamLocalizer(config.slam, config.explorer.grid, config.explorer.sensor_model)
    return OdometryLocalizer()
