"""A floor cut into rectangles, and the walls and doorways between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.building import Box, Door

WALL_M = 0.15
"""Thickness of a wall."""
DOOR_M = 0.9
"""Clear width of a doorway."""
PANEL_M = 0.04
"""Thickness of a door's panel."""
JAMB_M = 0.15
"""Least wall between a doorway and the next wall."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Space:
    """A room or a corridor: an axis-aligned rectangle up to the middle of the walls around it, in metres."""

    kind: str
    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def is_room(self) -> bool:
        return self.kind != "corridor"

    def floor(self) -> tuple[float, float, float, float]:
        """x0, y0, x1, y1 of the floor between its walls."""
        t = 0.5 * WALL_M
        return round(self.x0 + t, 6), round(self.y0 + t, 6), round(self.x1 - t, 6), round(self.y1 - t, 6)


@dataclass(frozen=True, slots=True)
class SharedWall:
    """A stretch of wall with a space on either side: metres, low to high on one axis, at on the other."""

    is_along_x: bool
    at: float
    low: float
    high: float

    @property
    def fits_a_door(self) -> bool:
        return self.high - self.low >= DOOR_M + WALL_M + 2.0 * JAMB_M


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall: a doorway if it has a door, else as wide as the corridor behind it."""

    wall: SharedWall
    low: float
    high: float
    has_door: bool


def shared_wall(a: Space, b: Space) -> SharedWall | None:
    """The wall between two spaces; None if they only meet at a corner, or not at all."""
    for is_along_x in (True, False):
        (a0, a1), (a_low, a_high) = _sides(a, is_along_x)
        (b0, b1), (b_low, b_high) = _sides(b, is_along_x)
        low, high = max(a_low, b_low), min(a_high, b_high)
        if low < high and (a1 == b0 or b1 == a0):
            return SharedWall(is_along_x, a1 if a1 == b0 else a0, low, high)
    return None


def _sides(space: Space, is_along_x: bool) -> tuple[Interval, Interval]:
    """Where its walls of one direction stand, and from where to where they run."""
    x, y = (space.x0, space.x1), (space.y0, space.y1)
    return (y, x) if is_along_x else (x, y)


def doorway(a: Space, b: Space, rng: np.random.Generator) -> Opening | None:
    """A door somewhere in the wall between two spaces; None if it has no room for one."""
    wall = shared_wall(a, b)
    if wall is None or not wall.fits_a_door:
        return None
    margin = 0.5 * (WALL_M + DOOR_M) + JAMB_M
    middle = round(rng.uniform(wall.low + margin, wall.high - margin), 2)
    return Opening(wall, middle - 0.5 * DOOR_M, middle + 0.5 * DOOR_M, has_door=True)


def mouth(a: Space, b: Space) -> Opening | None:
    """No wall at all between two spaces: a corridor that joins another."""
    wall = shared_wall(a, b)
    if wall is None:
        return None
    return Opening(wall, wall.low + 0.5 * WALL_M, wall.high - 0.5 * WALL_M, has_door=False)


def walls_of(spaces: Sequence[Space], openings: Sequence[Opening]) -> list[Box]:
    """The walls around all spaces, one box a stretch."""
    edges: dict[tuple[bool, float], list[Interval]] = defaultdict(list)
    holes: dict[tuple[bool, float], list[Interval]] = defaultdict(list)
    for space in spaces:
        for is_along_x in (True, False):
            places, stretch = _sides(space, is_along_x)
            for at in places:
                edges[is_along_x, at].append(stretch)
    for opening in openings:
        holes[opening.wall.is_along_x, opening.wall.at].append((opening.low, opening.high))
    t = 0.5 * WALL_M
    walls = []
    for (is_along_x, at), stretches in sorted(edges.items()):
        for low, high in _union(stretches):
            for a, b in _without((low - t, high + t), sorted(holes[is_along_x, at])):
                walls.append(_box_along(is_along_x, at, a, b, WALL_M))
    return walls


def doors_of(openings: Sequence[Opening]) -> list[Door]:
    """The panels that would close the doorways."""
    return [
        Door(_box_along(o.wall.is_along_x, o.wall.at, o.low, o.high, PANEL_M, "door"))
        for o in openings
        if o.has_door
    ]


def _box_along(
    is_along_x: bool, at: float, low: float, high: float, thickness: float, kind: str = "wall"
) -> Box:
    middle, half = round(0.5 * (low + high), 6), round(0.5 * (high - low), 6)
    if is_along_x:
        return Box(middle, at, half, 0.5 * thickness, kind=kind)
    return Box(at, middle, 0.5 * thickness, half, kind=kind)


def _union(intervals: list[Interval]) -> list[Interval]:
    merged: list[Interval] = []
    for low, high in sorted(intervals):
        if merged and low <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(high, merged[-1][1]))
        else:
            merged.append((low, high))
    return merged


def _without(interval: Interval, holes: list[Interval]) -> list[Interval]:
    """What is left of an interval; holes must be sorted."""
    left, (low, end) = [], interval
    for a, b in holes:
        if b <= low or a >= end:
            continue
        if a > low:
            left.append((low, a))
        low = b
    return [*left, (low, end)] if low < end else left
