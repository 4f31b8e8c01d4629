"""A spinning planar lidar: MuJoCo ray casts, then all that a real one gets wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.scan import Scan
from sim.lidar_noise import LidarNoise, LidarNoiseConfig, LidarStreams

if TYPE_CHECKING:
    from sim.world import World

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LidarConfig:
    """What the lidar's data sheet would say."""

    beams: int = 360
    """Beams a turn."""
    rate_hz: float = 10.0
    """Turns a second; the robot thinks once a turn."""
    field_of_view_rad: float = 2.0 * math.pi
    """Symmetric about forward."""
    min_range_m: float = 0.05
    """What is nearer is not measured."""
    max_range_m: float = 12.0
    """Beyond this a beam returns nothing."""
    spin: bool = False
    """Cast each beam from where the lidar was at the beam's own instant, instead of all of them at once."""
    noise: LidarNoiseConfig = field(default_factory=LidarNoiseConfig)

    def __post_init__(self) -> None:
        if self.beams < 1:
            raise ValueError(f"a lidar needs at least 1 beam, got {self.beams}")
        if not 0.0 < self.field_of_view_rad <= 2.0 * math.pi + 1e-9:
            raise ValueError(f"field_of_view_rad must be in (0, 2 pi], got {self.field_of_view_rad}")
        if not 0.0 <= self.min_range_m < self.max_range_m < math.inf:
            raise ValueError(
                f"need 0 <= min_range_m < max_range_m < inf, got {self.min_range_m} and {self.max_range_m}"
            )
        if not 0.0 < self.rate_hz < math.inf:
            raise ValueError(f"rate_hz must be positive, got {self.rate_hz}")

    def bearings_rad(self) -> Floats:
        """(beams,) counter-clockwise from the right edge of the field of view; a full turn begins behind."""
        if self.field_of_view_rad >= 2.0 * math.pi - 1e-9:
            return np.linspace(-math.pi, math.pi, self.beams, endpoint=False)
        half = 0.5 * self.field_of_view_rad
        return np.linspace(-half, half, self.beams) if self.beams > 1 else np.zeros(1)


SPIN_PIECES = 8
"""A spinning lidar casts its turn in so many pieces, each from one place: at 0.5 m/s and 10 Hz no beam starts
more than 3.2 mm from where it should."""


class Lidar:
    """Measures a world from the robot's `lidar` site.

    The body stays level within a fraction of a degree, so the lidar's plane is taken to be level.
    """

    def __init__(self, world: World, streams: LidarStreams, config: LidarConfig | None = None) -> None:
        from sim.ray_scene import RayScene

        self.config = config or LidarConfig()
        self.bearings_rad = self.config.bearings_rad()
        self.robot_from_lidar, height_m = world.lidar_mount()
        self.period_s = 1.0 / self.config.rate_hz
        self._rays = RayScene(world.solids, self.config.max_range_m, height_m)
        self._noise = LidarNoise(self.config.noise, streams)
        # The turn ends with the last beam at the stamp.
        ages = np.arange(len(self.bearings_rad) - 1, -1, -1) / len(self.bearings_rad)
        self._beam_times_s = -self.period_s * ages
        if self.config.spin:
            world.trail.keep_s = max(world.trail.keep_s, self.period_s)

    def measure(self, world: World) -> Scan:
        """The scan that ends now."""
        if world.faults.blind(world.time_s):
            ranges = np.full(len(self.bearings_rad), math.nan)
        else:
            exact = self.exact_ranges_m(world)
            ranges = self._noise.spoil(exact, self.config.min_range_m, self.config.max_range_m)
        times = self._beam_times_s if self.config.spin else None
        return Scan(self.bearings_rad, ranges, self.config.max_range_m, self.config.min_range_m, times)

    def exact_ranges_m(self, world: World) -> Floats:
        """(beams,) true distances along the beams, inf where nothing is within max_range_m."""
        if not self.config.spin:
            world_from_lidar = world.world_from_robot @ self.robot_from_lidar
            angles = world_from_lidar.yaw_rad + self.bearings_rad
            return self._rays.cast(*world_from_lidar.position, angles, world.panels)
        x, y, yaw = self._lidar_poses(world).T
        angles = yaw + self.bearings_rad
        pieces = np.array_split(np.arange(len(x)), min(SPIN_PIECES, len(x)))
        return np.concatenate(
            [self._rays.cast(x[p].mean(), y[p].mean(), angles[p], world.panels) for p in pieces]
        )

    def _lidar_poses(self, world: World) -> Floats:
        """(beams, 3) x, y and yaw of the lidar in the world at each beam's own instant."""
        x, y, yaw = world.trail.at(world.time_s + self._beam_times_s).T
        mount, c, s = self.robot_from_lidar, np.cos(yaw), np.sin(yaw)
        return np.column_stack(
            (x + c * mount.x_m - s * mount.y_m, y + s * mount.x_m + c * mount.y_m, yaw + mount.yaw_rad)
        )
