"""A rectangle of the map: what a scan votes on, what is built anew."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Box:
    """A rectangle of the map, in metres."""

    low_x: float
    low_y: float
    high_x: float
    high_y: float

    @staticmethod
    def everywhere() -> Box:
        """The box without bounds."""
        return Box(-math.inf, -math.inf, math.inf, math.inf)

    @staticmethod
    def around(x: float, y: float, reach_m: float) -> Box:
        """The square that reaches reach_m from a place (m) along both axes."""
        return Box(x - reach_m, y - reach_m, x + reach_m, y + reach_m)

    @staticmethod
    def over(boxes: list[Box], room_m: float = 0.0) -> Box:
        """The least box that holds all of them, and some room around."""
        return Box(
            min(b.low_x for b in boxes) - room_m,
            min(b.low_y for b in boxes) - room_m,
            max(b.high_x for b in boxes) + room_m,
            max(b.high_y for b in boxes) + room_m,
        )

    @property
    def area_m2(self) -> float:
        """Its area; inf without bounds."""
        return (self.high_x - self.low_x) * (self.high_y - self.low_y)

    def meets(self, other: Box) -> bool:
        """Whether the two have a place in common, be it on their edges."""
        return (
            self.low_x <= other.high_x
            and other.low_x <= self.high_x
            and self.low_y <= other.high_y
            and other.low_y <= self.high_y
        )

    def holds(self, other: Box) -> bool:
        """Whether all of the other lies within."""
        return (
            self.low_x <= other.low_x
            and self.low_y <= other.low_y
            and other.high_x <= self.high_x
            and other.high_y <= self.high_y
        )
