"""What a building is: solids on a floor, rooms, doors and a start."""

from __future__ import annotations

import math
from dataclasses import dataclass

from occmap.geometry import Pose2

Bounds = tuple[float, float, float, float]
"""low x, low y, high x, high y in metres."""
FARTHEST_M = 1e6
"""Contacts beyond this are so coarse that robots pass through walls."""


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box standing on the floor, turned by yaw."""

    x_m: float
    y_m: float
    half_x_m: float
    half_y_m: float
    yaw_rad: float = 0.0
    height_m: float = 1.0
    kind: str = "wall"  # wall, furniture, column, shelf, ...: decides the colour, nothing else

    def bounds(self) -> Bounds:
        """The axis-aligned rectangle around it."""
        c, s = abs(math.cos(self.yaw_rad)), abs(math.sin(self.yaw_rad))
        x, y = c * self.half_x_m + s * self.half_y_m, s * self.half_x_m + c * self.half_y_m
        return self.x_m - x, self.y_m - y, self.x_m + x, self.y_m + y


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder standing on the floor: a column, a table's leg."""

    x_m: float
    y_m: float
    radius_m: float
    height_m: float = 1.0
    kind: str = "furniture"

    def bounds(self) -> Bounds:
        """The axis-aligned rectangle around it."""
        r = self.radius_m
        return self.x_m - r, self.y_m - r, self.x_m + r, self.y_m + r


Solid = Box | Cylinder


@dataclass(frozen=True, slots=True)
class Door:
    """A doorway and the panel that would fill it. Doors stand open unless the world closes them."""

    panel: Box


@dataclass(frozen=True, slots=True)
class Room:
    """A named axis-aligned rectangle of floor."""

    name: str
    low_m: tuple[float, float]
    high_m: tuple[float, float]


@dataclass(frozen=True)
class Building:
    """A floor plan in the `world` frame, metres and radians: every solid that a robot could touch or see."""

    name: str
    kind: str
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    solids: tuple[Solid, ...]
    start: Pose2
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (*self.low_m, *self.high_m)):
            raise ValueError(f"a building's bounds must be finite, got {self.low_m} to {self.high_m}")
        if not (self.low_m[0] < self.high_m[0] and self.low_m[1] < self.high_m[1]):
            raise ValueError(f"a building's bounds must enclose an area, got {self.low_m} to {self.high_m}")
        if max(map(abs, (*self.low_m, *self.high_m))) > FARTHEST_M:
            raise ValueError(
                f"a building's bounds must lie within {FARTHEST_M:.0f} m of the origin, got {self.low_m} to "
                f"{self.high_m}: move its origin nearer"
            )
