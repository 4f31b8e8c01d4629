"""Offices: corridors with rooms on both sides, cross corridors that close loops, dead ends, suites."""

from __future__ import annotations

import numpy as np

from sim.building import Building
from sim.generators.floor import Size, furnished, transposed
from sim.generators.ladder import LadderConfig, ladder
from sim.generators.spaces import Opening, SharedWall

DEFAULT_SIZE_M = (30.0, 20.0)
LEAST_SIZE_M = (11.5, 9.5)
LEAST_ROOMS = 10


def office(size_m: Size, rng: np.random.Generator) -> Building | None:
    """A furnished office floor; None if this draw did not work out."""
    turned = size_m[1] > size_m[0] or (min(size_m) >= 18.0 and rng.random() < 0.3)
    spaces, openings = ladder((size_m[1], size_m[0]) if turned else size_m, LadderConfig(), office_kind, rng)
    if sum(space.is_room for space in spaces) < LEAST_ROOMS:
        return None
    if turned:
        spaces, openings = transposed(spaces), [_turned(o) for o in openings]
    return furnished("office", size_m, spaces, openings, rng)


def office_kind(area_m2: float, rng: np.random.Generator) -> str:
    """What a room of this size is used for."""
    if area_m2 < 9.0:
        return str(rng.choice(["office", "store", "office"]))
    if area_m2 < 22.0:
        return str(rng.choice(["office", "office", "office", "meeting", "kitchen", "store"]))
    return str(rng.choice(["open plan", "open plan", "meeting", "lounge"]))


def _turned(opening: Opening) -> Opening:
    wall = opening.wall
    return Opening(
        SharedWall(not wall.is_along_x, wall.at, wall.low, wall.high),
        opening.low,
        opening.high,
        opening.has_door,
    )
