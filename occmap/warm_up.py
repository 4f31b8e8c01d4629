"""All kernels compiled, or loaded from where they are kept, before a robot's first scan."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from occmap.body import Body
from occmap.decision import Status
from occmap.explorer import Explorer
from occmap.explorer_config import ExplorerConfig
from occmap.geometry import Pose2, Twist2
from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.map_localizer import MapLocalizer
from occmap.pace import PaceConfig
from occmap.rehearsal import close_loops, find_oneself, garbage_left_alone, rare_moments, settle_a_graph
from occmap.scan import Observation, Scan

DRIVE_S = 4.0
"""Long enough to look around, plan and drive."""
SCANS = 40
"""Nor is a drive shorter than this."""
EVERY = 8
"""Of the scans of that drive: to close loops takes few."""


def warm_up(explorer: Explorer) -> None:
    """Compile, or load from the cache, all kernels that an explorer may need: to be called before it drives.

    Another explorer, of the same config and body, looks around in a made-up room; a localizer of the same
    kind closes loops there, or finds itself. The one that was handed in is only looked at. Without this the
    robot's first decisions take as long: seconds, and at the first run of all, half a minute. A kernel is
    kept in `__pycache__` beside its module, or where NUMBA_CACHE_DIR says.

    What is in memory afterwards is never looked through for garbage again (gc.freeze).
    """
    config, localizer = explorer.config, explorer.perception.localizer
    with garbage_left_alone():
        seen = _explore(config, explorer.body)
        if isinstance(localizer, SlamLocalizer):
            _localise(seen, localizer.config, config)
        elif isinstance(localizer, MapLocalizer):
            slam = _localise(seen, localizer.slam_config, config)
            find_oneself(MapLocalizer(slam, config=localizer.config), seen)


def _localise(seen: list[Observation], slam: SlamConfig, config: ExplorerConfig) -> SlamLocalizer:
    settle_a_graph()
    return close_loops(seen[::EVERY], slam, config.grid, config.sensor_model)


def _explore(config: ExplorerConfig, body: Body) -> list[Observation]:
    """Explore a room as large as suits the body, knowing the pose; what was seen on the way."""
    room = Room(max(1.0, body.radius_m / Body().radius_m))
    quick = replace(config, pace=PaceConfig(first_look_s=0.5), boundary_in_map=())
    explorer, seen = Explorer(quick, body=body), []
    here = start = Pose2(-1.5 * room.scale, 0.3 * room.scale, 0.2)
    for k in range(max(SCANS, math.ceil(DRIVE_S / body.period_s))):
        odom_from_robot = start.inverse() @ here
        seen.append(Observation(k * body.period_s, odom_from_robot, room.scan(here), Pose2.identity()))
        decision = explorer.decide(seen[-1])
        if decision.status is not Status.EXPLORING:
            break
        here = here @ _way(decision.twist, body.period_s)
    rare_moments(explorer, explorer.perception.localizer.update(seen[-1]).map_from_robot)
    return seen


def _way(twist: Twist2, period_s: float) -> Pose2:
    """How a twist moves the robot: along the chord of an arc."""
    turn_rad, length_m = twist.angular_radps * period_s, twist.linear_mps * period_s
    return Pose2(length_m * math.cos(0.5 * turn_rad), length_m * math.sin(0.5 * turn_rad), turn_rad)


@dataclass(frozen=True)
class Room:
    """A room of 6 m x 4 m around the origin and a wall in it, enlarged."""

    scale: float = 1.0

    def scan(self, world_from_lidar: Pose2) -> Scan:
        """What a lidar sees from a place in the room: exact ranges."""
        walls = self.scale * np.array(
            [(-3.1, 2.0, 3.1, 2.2), (-3.1, -2.2, 3.1, -2.0), (3.0, -2.0, 3.2, 2.0), (-3.2, -2.0, -3.0, 2.0),
             (0.4, 0.0, 0.6, 2.0)]
        )  # fmt: skip
        bearings_rad = np.radians(np.arange(-180.0, 180.0))
        looks_rad = bearings_rad + world_from_lidar.yaw_rad
        inverse = 1.0 / np.column_stack((np.cos(looks_rad), np.sin(looks_rad)))[:, None]
        one, other = (
            (corner - np.array(world_from_lidar.position)) * inverse
            for corner in (walls[:, :2], walls[:, 2:])
        )
        enters, leaves = np.minimum(one, other).max(axis=2), np.maximum(one, other).min(axis=2)
        ranges_m = np.where((enters <= leaves) & (enters > 0.0), enters, np.inf).min(axis=1)
        return Scan(bearings_rad, ranges_m, max_range_m=12.0 * self.scale, min_range_m=0.05)
