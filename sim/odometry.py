"""Where the wheels say the robot is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from occmap.geometry import Pose2

if TYPE_CHECKING:
    from sim.world import World


class Odometer(Protocol):
    """Anything that tells odom_from_robot, the identity at the beginning."""

    def read(self, world: World) -> Pose2:
        """The pose now. Read once a cycle: what happens in between is taken for one arc."""
        ...


@dataclass(frozen=True)
class OdometryConfig:
    """How far the robot's idea of its wheels is from the truth."""

    radius_error: float = 0.005
    """Each wheel's radius is off by up to this share, drawn once: tyres wear and carry unequal loads."""
    track_error: float = 0.01
    """The distance between the wheels is off by up to this share, drawn once."""
    ticks_per_turn: int = 1024
    """Encoder resolution: 0.3 mm of floor a tick with wheels of 5 cm."""
    tick_noise: float = 0.1
    """One sigma, in ticks, of the ticks lost or won while one passes; it grows with the root of the way."""

    def __post_init__(self) -> None:
        for name in ("radius_error", "track_error"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{name} must be a share from 0 to 1, got {getattr(self, name)}")
        if self.ticks_per_turn < 1:
            raise ValueError(f"ticks_per_turn must be at least 1, got {self.ticks_per_turn}")
        if not 0.0 <= self.tick_noise < math.inf:
            raise ValueError(f"tick_noise must not be negative, got {self.tick_noise}")

    def scaled(self, factor: float) -> OdometryConfig:
        """The same wheels with every error multiplied; 0 leaves perfect encoders."""
        if not 0.0 <= factor < math.inf:
            raise ValueError(f"a drift scale must not be negative, got {factor}")
        return replace(
            self,
            radius_error=self.radius_error * factor,
            track_error=self.track_error * factor,
            tick_noise=self.tick_noise * factor,
        )


class Odometry:
    """Integrates encoder ticks of a differential drive.

    Most of the drift is systematic (Borenstein and Feng, "Measurement and Correction of Systematic Odometry
    Errors in Mobile Robots", 1996): unequal wheels turn a straight line into an arc, and a wrong track makes
    every turn too long or too short.
    """

    def __init__(self, world: World, rng: np.random.Generator, config: OdometryConfig | None = None) -> None:
        self.config = config or OdometryConfig()
        self._rng = rng
        # Three numbers whatever the levels are: scaling one error leaves the others where they were.
        left, right, track = rng.uniform(-1.0, 1.0, 3).tolist()
        self._left_radius_m = world.wheel_radius_m * (1.0 + self.config.radius_error * left)
        self._right_radius_m = world.wheel_radius_m * (1.0 + self.config.radius_error * right)
        self._track_m = world.track_m * (1.0 + self.config.track_error * track)
        self._ticks = self._count(world)
        self._pose = Pose2.identity()

    def read(self, world: World) -> Pose2:
        """odom_from_robot after the ticks counted since the last reading."""
        ticks = self._count(world)
        noise = self._rng.standard_normal(2).tolist()
        tick_rad = 2.0 * math.pi / self.config.ticks_per_turn
        left, right = (
            tick_rad * (now - before + self.config.tick_noise * math.sqrt(abs(now - before)) * chance)
            for now, before, chance in zip(ticks, self._ticks, noise, strict=True)
        )
        self._ticks = ticks
        self._pose = self._pose @ arc(left * self._left_radius_m, right * self._right_radius_m, self._track_m)
        return self._pose

    def _count(self, world: World) -> tuple[int, int]:
        left, right = world.wheel_angles_rad
        ticks_per_rad = self.config.ticks_per_turn / (2.0 * math.pi)
        return math.floor(left * ticks_per_rad), math.floor(right * ticks_per_rad)


class TrueOdometry:
    """The true pose relative to the start: odometry that never drifts, for runs with known poses."""

    def __init__(self, world: World) -> None:
        self._start_from_world = world.world_from_robot.inverse()

    def read(self, world: World) -> Pose2:
        """odom_from_robot, exactly."""
        return self._start_from_world @ world.world_from_robot


def arc(left_m: float, right_m: float, track_m: float) -> Pose2:
    """The motion of a differential drive whose wheels rolled so far: a piece of a circle."""
    turn_rad = (right_m - left_m) / track_m
    chord_m = 0.5 * (left_m + right_m) * float(np.sinc(turn_rad / (2.0 * math.pi)))
    return Pose2(chord_m * math.cos(0.5 * turn_rad), chord_m * math.sin(0.5 * turn_rad), turn_rad)
