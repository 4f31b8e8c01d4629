"""How the explorer values what it could look at."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

from occmap.strategies import Strategy
from occmap.tour import TourConfig

NEVER_NEGATIVE = (
    *("gain_range_m", "min_frontier_m", "min_far_frontier_m", "min_nook_m"),
    *("worth_way_m", "worth_gain_m2", "worth_nook_m2", "hysteresis_m"),
)

SPECK_M = 0.35
"""What is longer is no speck, however coarse the cells; the robot is as wide."""
COARSE_M = 0.075
"""From here on two cells of a wall's rim in a row say nothing."""


@dataclass(frozen=True)
class GoalConfig:
    """How the explorer values what it could look at."""

    strategy: Strategy = "tour"
    """nearest: the frontier with the shortest way to it. utility: lambda * gain - cost. gain_per_cost and
    gain_decay: gain / cost and gain * exp(-cost / 10 m). tour: the first on the best way through all."""
    lambda_m_per_m2: float = 0.3
    """Metres the robot would drive to see one more square metre (strategy utility). More of it is faster to
    90 % and slower to the end."""
    gain: Literal["raycast", "size"] = "raycast"
    """raycast: unknown area that a look from the viewpoint is expected to reveal. size: cheaper,
    the frontier's length times a depth of 1 m."""
    gain_range_m: float = 4.0
    """How far an expected look reaches, if the lidar does: nobody knows where the walls behind a frontier
    are."""
    look_from_m: tuple[float, ...] = (2.5, 1.2, 0.5)
    """A viewpoint lies at most this far from its frontier, or as the lidar sees; each look that fails goes
    nearer."""
    look_into_m: tuple[float, ...] = (0.2, 0.2, 0.2)
    """Those looks are aimed this deep into the unknown, deeper where a frontier is short: what grazes a
    frontier only moves it on a little."""
    min_frontier_m: float = 0.2
    """A shorter frontier is a speck: no gap that the body fits through is this narrow."""
    min_far_frontier_m: float = 0.5
    """A frontier that only a look from farther than look_from_m[0] can see must be this long."""
    min_nook_m: float = 0.1
    """When nothing else is left, edges of the unknown along walls get one look if they are this long."""
    worth_way_m: float = 10.0
    """A way longer than this must promise worth_gain_m2; one to a nook, worth_nook_m2."""
    worth_gain_m2: float = 0.1
    """Unknown area that makes a long way worth it, somewhat more than the robot stands on: what hides less is
    seen in passing."""
    worth_nook_m2: float = 0.4
    """The same for nooks, by their mouth times the depth looked at. Most hide less than they promise, and one
    that was looked into is not come back for from so far."""
    hysteresis_m: float = 1.0
    """Another goal must be better by this much before a good one is abandoned for it."""
    tour: TourConfig = field(default_factory=TourConfig)

    def __post_init__(self) -> None:
        if self.strategy not in get_args(Strategy):
            raise ValueError(
                f"unknown strategy {self.strategy!r}: choose from {', '.join(get_args(Strategy))}"
            )
        if self.gain not in ("raycast", "size"):
            raise ValueError(f"gain must be raycast or size, got {self.gain!r}")
        if not (math.isfinite(self.lambda_m_per_m2) and self.lambda_m_per_m2 >= 0.0):
            raise ValueError(f"lambda must not be negative, got {self.lambda_m_per_m2}")
        for name in NEVER_NEGATIVE:
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} must not be negative, got {getattr(self, name)}")
        looks_m = (*self.look_from_m, *self.look_into_m)
        if not looks_m or not all(math.isfinite(value) and value > 0.0 for value in looks_m):
            raise ValueError(f"looks need positive distances, got {self.look_from_m} and {self.look_into_m}")
        if len(self.look_from_m) != len(self.look_into_m):
            raise ValueError(
                f"look_from_m and look_into_m must pair up, got {self.look_from_m} and {self.look_into_m}"
            )

    def least_frontier_m(self, resolution_m: float) -> float:
        """Least length that is no speck; three coarse cells, such as the corners of walls make, are one."""
        return max(self.min_frontier_m, min(4.0 * resolution_m, SPECK_M))

    def least_nook_m(self, resolution_m: float) -> float:
        """Least length that is no speck, for edges along walls."""
        cells = 2.0 if resolution_m < COARSE_M else 3.0  # walls askew cut the corners of coarse cells
        return max(self.min_nook_m, min(cells * resolution_m, SPECK_M))

    def least_far_nook_m2(self, resolution_m: float) -> float:
        """Area that a nook far off must promise: a mouth counted in cells that the body might fit through, a
        metre deep. Anything, if worth_nook_m2 is 0.
        """
        return max(self.worth_nook_m2, SPECK_M + resolution_m) if self.worth_nook_m2 else 0.0
