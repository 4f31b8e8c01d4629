"""What the robot's mind must know of the base that it drives."""

from __future__ import annotations

from dataclasses import dataclass

from occmap.config_checks import Positive


@dataclass(frozen=True)
class Body(Positive):
    """A round differential drive: how large it is, and what its motors allow."""

    radius_m: float = 0.17
    """A circle around the robot's axis that encloses the body."""
    max_speed_mps: float = 0.5
    """What the base does at most."""
    max_turn_radps: float = 1.5
    """What the base turns at most."""
    acceleration_mps2: float = 1.0
    """The base's ramp: how fast it gains and loses speed."""
    turn_acceleration_radps2: float = 3.0
    """The base's ramp for turning."""
    period_s: float = 0.1
    """A command stands for so long: until the next scan. It must be the time from one call of Explorer.decide
    to the next, by which waiting is timed: 0.1 for a lidar that turns ten times a second."""
