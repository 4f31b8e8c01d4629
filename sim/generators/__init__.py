"""Seeded buildings: office, apartment, maze, hall, rooms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:
    import numpy as np

    from sim.building import Building

Kind = Literal["office", "apartment", "maze", "hall", "rooms"]
DEFAULT_SIZE_M: dict[str, tuple[float, float]] = {
    "office": (30.0, 20.0),
    "apartment": (13.0, 9.0),
    "maze": (20.0, 20.0),
    "hall": (30.0, 20.0),
    "rooms": (100.0, 100.0),
}
LEAST_SIZE_M: dict[str, tuple[float, float]] = {
    "office": (7.0, 6.0),
    "apartment": (9.0, 7.0),
    "maze": (4.0, 4.0),
    "hall": (11.0, 10.0),
    "rooms": (8.0, 8.0),
}
LARGEST_M = 300.0
ATTEMPTS = 60
"""Draws before a size is given up."""
FURNISHED = ("office", "apartment", "hall")
"""Kinds in which a table stands on thin legs, hard to see as they are, wherever the size has room for one."""


@dataclass(frozen=True)
class BuildingConfig:
    """Which building to generate."""

    kind: Kind = "office"
    """office: corridors, rooms, loops; apartment: rooms around a hallway; maze; hall: shelves, columns;
    rooms: large, bare, overlapping rectangles and wide corridors."""
    seed: int | None = None
    """Same seed, same building; by default a child of the run's seed."""
    size_m: tuple[float, float] | None = None
    """Outer width and height; by default office and hall 30 x 20, maze 20 x 20, apartment 13 x 9,
    rooms 100 x 100."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ValueError(
                f"unknown kind of building {self.kind!r}: choose from {', '.join(get_args(Kind))}"
            )
        if self.seed is not None and self.seed < 0:
            raise ValueError(f"the building's seed must not be negative, got {self.seed}")
        if self.size_m is not None:
            self._check_size(self.size_m)

    def _check_size(self, size_m: tuple[float, float]) -> None:
        least = sorted(LEAST_SIZE_M[self.kind])
        given = sorted(size_m)
        if not all(math.isfinite(side) and side <= LARGEST_M for side in size_m):
            raise ValueError(f"size_m must be at most {LARGEST_M} m a side, got {size_m}")
        if any(side < low for side, low in zip(given, least, strict=True)):
            raise ValueError(
                f"a building of kind {self.kind} needs at least {least[1]} x {least[0]} m, got {size_m}"
            )


def generate(config: BuildingConfig, rng: np.random.Generator) -> Building:
    """A building of this kind, in which the start reaches all rooms. The rng alone decides which."""
    from sim.generators import apartment, hall, maze, office, rooms
    from sim.generators.furniture import has_thin_legs

    makers = {
        "office": office.office,
        "apartment": apartment.apartment,
        "maze": maze.maze,
        "hall": hall.hall,
        "rooms": rooms.rooms,
    }
    size_m = config.size_m or DEFAULT_SIZE_M[config.kind]
    legless: Building | None = None
    for _ in range(ATTEMPTS):
        building = makers[config.kind](size_m, rng)
        if building is not None and (config.kind not in FURNISHED or has_thin_legs(building)):
            return building
        legless = legless or building
    if legless is None:
        raise ValueError(f"no {config.kind} of {size_m[0]} x {size_m[1]} m worked out in {ATTEMPTS} attempts")
    return legless
