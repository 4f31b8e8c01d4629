"""How many metres a robot goes to one that its wheels claim, learnt on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass

from occmap.config_checks import Positive
from occmap.geometry import Pose2


@dataclass(frozen=True)
class WheelScaleConfig(Positive):
    """How fast wheels are learnt: tyres wear and are pumped up, and nobody measures them anew."""

    memory_m: float = 200.0
    """What was seen of the wheels counts for so many metres."""
    doubt_m: float = 20.0
    """Until so much was seen, they are taken to be at most half as wrong as they seem."""
    most: float = 0.1
    """They are never taken to be wrong by more than this share."""
    least_step_m: float = 0.02
    """Shorter steps tell nothing."""
    most_apart: float = 0.5
    """Nor do those that differ by more than this share: they slipped, or the scan misled."""


class WheelScale:
    """The ratio of two sums, along the robot's own axis: the noise of single steps cancels out in it.

    The simplest of the parameters that Censi et al., Simultaneous calibration of odometry and sensor
    parameters for mobile robots, T-RO 2013, learn. What wheels claim too much or too little in every step
    pulls the poses with it where a corridor's scans say nothing against it.
    """

    def __init__(self, config: WheelScaleConfig) -> None:
        self.config = config
        self._claimed_m = 0.0
        self._gone_m = 0.0

    def learn(self, claimed_m: float, gone_m: float) -> None:
        """Take in a step forward as the wheels claim it and as the scans have it; backward, both negative."""
        c, length_m = self.config, abs(claimed_m)
        if length_m < c.least_step_m or abs(gone_m - claimed_m) > c.most_apart * length_m:
            return
        kept = math.exp(-length_m / c.memory_m)
        self._claimed_m = kept * self._claimed_m + length_m
        self._gone_m = kept * self._gone_m + math.copysign(1.0, claimed_m) * gone_m

    @property
    def factor(self) -> float:
        """Metres gone for each one claimed."""
        c = self.config
        ratio = (c.doubt_m + self._gone_m) / (c.doubt_m + self._claimed_m)
        return min(max(ratio, 1.0 - c.most), 1.0 + c.most)

    def corrected(self, step: Pose2) -> Pose2:
        """A step of the wheels, as long as it probably is."""
        return Pose2(self.factor * step.x_m, self.factor * step.y_m, step.yaw_rad)
