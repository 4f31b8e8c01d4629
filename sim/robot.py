"""A robot in its world: it senses, it acts, and the truth about it is kept apart."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from occmap.geometry import Pose2, Twist2
from occmap.scan import Observation

if TYPE_CHECKING:
    from sim.lidar import Lidar
    from sim.odometry import Odometer
    from sim.world import World


@dataclass(frozen=True)
class RobotConfig:
    """What the base's own motor controller allows."""

    max_linear_mps: float = 0.5
    """A walking pace would be 1.4."""
    max_angular_radps: float = 1.5
    """A turn on the spot in about four seconds."""
    max_linear_accel_mps2: float = 1.0
    """More would spin the wheels, which the odometry does not notice."""
    max_angular_accel_radps2: float = 3.0
    """The same for turning."""
    control_hz: float = 50.0
    """How often the motor controller sets the wheels' speeds."""

    def __post_init__(self) -> None:
        for name in (
            "max_linear_mps",
            "max_angular_radps",
            "max_linear_accel_mps2",
            "max_angular_accel_radps2",
            "control_hz",
        ):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


@dataclass(frozen=True)
class Truth:
    """What is so, whatever the robot believes: for scoring and for looking at, never for deciding."""

    time_s: float
    world_from_robot: Pose2
    twist: Twist2
    collision_events: int
    collision_duration_s: float
    clearance_m: float
    """From the body to the nearest solid; at most 5 m; slightly negative while pressed on one."""
    path_length_m: float
    door_heights_m: tuple[float, ...] = ()
    """How far each closing door stands out of the floor."""


class Robot:
    """A differential drive with a lidar: `sense`, then `act` for one turn of the lidar, and again."""

    def __init__(
        self, world: World, lidar: Lidar, odometer: Odometer, config: RobotConfig | None = None
    ) -> None:
        self.config = config or RobotConfig()
        self.world = world
        self.lidar = lidar
        self._odometer = odometer
        self._odom_from_robot = odometer.read(world)
        self._linear_mps, self._angular_radps = 0.0, 0.0  # what the wheels are told now, on the ramp
        self._path_length_m = 0.0
        self._check_wheels()
        self._steps_a_turn = _whole_steps(lidar.config.rate_hz, world.step_s, "lidar.rate_hz")
        self._steps_a_tick = _whole_steps(self.config.control_hz, world.step_s, "control_hz")

    @property
    def time_s(self) -> float:
        """Seconds since the run began."""
        return self.world.time_s

    def sense(self) -> Observation:
        """One scan and one reading of the wheels, now."""
        return Observation(
            self.time_s, self._odom_from_robot, self.lidar.measure(self.world), self.lidar.robot_from_lidar
        )

    def act(self, twist: Twist2) -> None:
        """Drive at a twist, as far as limits and ramps allow, until the next scan is due."""
        target = self._limited(twist)
        before = self.world.world_from_robot
        for done in range(0, self._steps_a_turn, self._steps_a_tick):
            steps = min(self._steps_a_tick, self._steps_a_turn - done)
            self._ramp(target, steps * self.world.step_s)
            self._turn_wheels()
            self.world.advance(steps)
        self._path_length_m += before.distance_to(self.world.world_from_robot)
        self._odom_from_robot = self._odometer.read(self.world)

    def truth(self) -> Truth:
        """The true state, now."""
        world = self.world
        here = world.world_from_robot
        return Truth(
            time_s=world.time_s,
            world_from_robot=here,
            twist=world.twist,
            collision_events=world.collisions.events,
            collision_duration_s=world.collisions.duration_s,
            clearance_m=world.clearance_m(),
            path_length_m=self._path_length_m,
            door_heights_m=tuple(world.doors.height_m.tolist()),
        )

    def _check_wheels(self) -> None:
        """A speed that the motors do not reach would be driven as another twist than the one asked for."""
        config, world = self.config, self.world
        across_mps = 0.5 * world.track_m * config.max_angular_radps
        fastest_radps = (config.max_linear_mps + across_mps) / world.wheel_radius_m
        if fastest_radps > world.wheel_limit_radps:
            raise ValueError(
                f"max_linear_mps {config.max_linear_mps} with max_angular_radps {config.max_angular_radps} "
                f"turns a wheel at {fastest_radps:.1f} rad/s, its motor reaches {world.wheel_limit_radps:g}: "
                "lower one of them"
            )

    def _limited(self, twist: Twist2) -> Twist2:
        config = self.config
        return Twist2(
            _clip(twist.linear_mps, config.max_linear_mps),
            _clip(twist.angular_radps, config.max_angular_radps),
        )

    def _ramp(self, target: Twist2, dt_s: float) -> None:
        config = self.config
        self._linear_mps += _clip(target.linear_mps - self._linear_mps, config.max_linear_accel_mps2 * dt_s)
        self._angular_radps += _clip(
            target.angular_radps - self._angular_radps, config.max_angular_accel_radps2 * dt_s
        )

    def _turn_wheels(self) -> None:
        world = self.world
        across_mps = 0.5 * world.track_m * self._angular_radps
        world.drive(
            (self._linear_mps - across_mps) / world.wheel_radius_m,
            (self._linear_mps + across_mps) / world.wheel_radius_m,
        )


def _clip(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value


def _whole_steps(rate_hz: float, step_s: float, name: str) -> int:
    """Physics steps in one period of a rate."""
    steps = 1.0 / (rate_hz * step_s)
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
        raise ValueError(f"{name} must divide the {1.0 / step_s:g} physics steps a second, got {rate_hz}")
    return round(steps)
