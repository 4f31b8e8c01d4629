"""How a robot that does not move tries to free itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from occmap.body import Body
from occmap.config_checks import Positive
from occmap.geometry import Twist2
from occmap.scan import Observation
from occmap.stuck import ROUNDING_S

CONE_RAD = math.radians(30.0)
"""What lies within this of straight ahead, or straight behind, is in the way."""
STEP_M = 0.1
"""So far the map is asked for room."""
LONGER_SHARE = 0.5
"""Of the first manoeuvre's legs, by which every second one's are longer."""

MapClearance = Callable[[float], float]
"""Metres ahead of the robot -> how far the map's nearest obstacle is from there, 0 outside of the map."""


@dataclass(frozen=True)
class RecoveryConfig(Positive):
    """Backing off and turning, a few times, before the robot calls itself stuck."""

    attempts: int = 6
    """Manoeuvres tried, every second one longer than those before, until the robot gives up."""
    speed_mps: float = 0.15
    """Slow: whatever holds the robot may be let go at once."""
    turn_radps: float = 0.8
    """Fast enough to tear a wheel off a threshold."""
    leg_s: float = 1.5
    """Duration of each leg of the first manoeuvre."""
    margin_m: float = 0.11
    """The robot backs (or goes ahead) only while the lidar sees this much room beyond its body."""
    forgive_after_s: float = 15.0
    """A robot that has driven freely for this long starts counting its attempts afresh."""


@dataclass(frozen=True, slots=True)
class _Leg:
    until_s: float
    twist: Twist2


class Recovery:
    """One manoeuvre at a time: away from where it was heading, then a turn, to alternate sides."""

    def __init__(self, config: RecoveryConfig | None = None, body: Body | None = None) -> None:
        self.config = config or RecoveryConfig()
        self.body = body or Body()
        self.attempts = 0
        self._legs: tuple[_Leg, ...] = ()

    @property
    def is_exhausted(self) -> bool:
        """Whether all attempts have been made."""
        return self.attempts >= self.config.attempts

    def begin(self, seen: Observation, commanded: Twist2) -> None:
        """Plan the next manoeuvre, given what was commanded when nothing moved."""
        c, now_s = self.config, seen.time_s
        self.attempts += 1
        leg_s = c.leg_s * (1.0 + LONGER_SHARE * (self.attempts // 2))
        away = -1.0 if commanded.linear_mps >= 0.0 else 1.0
        side = 1.0 if self.attempts % 2 else -1.0
        self._legs = (
            _Leg(now_s + leg_s, Twist2(away * min(c.speed_mps, self.body.max_speed_mps), 0.0)),
            _Leg(now_s + 2.0 * leg_s, Twist2(0.0, side * min(c.turn_radps, self.body.max_turn_radps))),
        )

    def is_under_way(self, now_s: float) -> bool:
        """Whether a manoeuvre is being driven."""
        return any(now_s < leg.until_s - ROUNDING_S for leg in self._legs)

    def twist(self, seen: Observation, map_clearance: MapClearance) -> Twist2 | None:
        """The manoeuvre's command at this moment, None when it is over. Driving ends where room does."""
        for leg in self._legs:
            if seen.time_s < leg.until_s - ROUNDING_S and self._has_room(
                seen, leg.twist.linear_mps, map_clearance
            ):
                return leg.twist
        return None

    def forgive(self) -> None:
        """Forget how many attempts it took: the robot moves again."""
        self.attempts = 0

    def _has_room(self, seen: Observation, speed_mps: float, map_clearance: MapClearance) -> bool:
        """Whether the lidar sees enough room that way; where it does not look, whether the map knows of it.

        A turn needs none, the body is round.
        """
        if speed_mps == 0.0:
            return True
        room_m, ahead = self.body.radius_m + self.config.margin_m, math.copysign(1.0, speed_mps)
        scan, mount = seen.scan, seen.robot_from_lidar
        looks_rad = scan.bearings_rad[scan.ranges_m >= scan.least_range_m] + mount.yaw_rad
        if not np.any(ahead * np.cos(looks_rad) > math.cos(CONE_RAD)):
            return map_clearance(ahead * STEP_M) >= min(map_clearance(0.0), room_m)
        hits = mount.apply(scan.hits_in_lidar())
        off_rad = np.abs(np.arctan2(hits[:, 1], ahead * hits[:, 0]))
        in_the_way = hits[off_rad < CONE_RAD]
        return bool(np.hypot(*in_the_way.T).min(initial=math.inf) >= room_m)
