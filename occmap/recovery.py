"""How a robot that does not move tries to free itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from occmap.geometry import Twist2
from occmap.scan import Scan


@dataclass(frozen=True)
class RecoveryConfig:
    """Backing off and turning, a few times, before the robot calls itself stuck."""

    attempts: int = 6
    """Manoeuvres tried, each a little longer than the last, before giving up."""
    speed_mps: float = 0.15
    turn_radps: float = 0.8
    leg_s: float = 1.5
    """Duration of each leg of the first manoeuvre."""
    room_m: float = 0.28
    """The robot backs (or goes ahead) only where the lidar sees this much room from its centre."""

    def __post_init__(self) -> None:
        if self.attempts < 1:
            raise ValueError(f"attempts must be at least 1, got {self.attempts}")


class Recovery:
    """One manoeuvre at a time: away from where it was heading, then a turn, to alternate sides."""

    def __init__(self, config: RecoveryConfig | None = None) -> None:
        self.config = config or RecoveryConfig()
        self.attempts = 0
        self._legs: list[tuple[float, Twist2]] = []  # (ends at s, what to do)

    @property
    def is_exhausted(self) -> bool:
        return self.attempts >= self.config.attempts

    def begin(self, now_s: float, commanded: Twist2, scan: Scan) -> None:
        """Plan the next manoeuvre, given what was commanded when nothing moved."""
        self.attempts += 1
        leg_s = self.config.leg_s * (1.0 + 0.5 * (self.attempts // 2))
        away = -1.0 if commanded.linear_mps >= 0.0 else 1.0
        if _room_m(scan, 0.0 if away > 0.0 else math.pi) < self.config.room_m:
            away = 0.0
        side = 1.0 if self.attempts % 2 else -1.0
        self._legs = [
            (now_s + leg_s, Twist2(away * self.config.speed_mps, 0.0)),
            (now_s + 2.0 * leg_s, Twist2(0.0, side * self.config.turn_radps)),
        ]

    def twist(self, now_s: float) -> Twist2 | None:
        """The manoeuvre's command at this time, None when it is over."""
        for ends_s, twist in self._legs:
            if now_s < ends_s - 1e-6:
                return twist
        return None

    def succeed(self) -> None:
        """The robot moves again."""
        self.attempts = 0
        self._legs = []


def _room_m(scan: Scan, bearing_rad: float) -> float:
    """Nearest return within 30 degrees of a bearing, inf if there is none."""
    off = np.abs((scan.bearings_rad - bearing_rad + math.pi) % (2.0 * math.pi) - math.pi)
    near = scan.ranges_m[(off < math.radians(30.0)) & scan.is_hit]
    return float(near.min()) if len(near) else math.inf
