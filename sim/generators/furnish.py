"""Puts furniture into a room: along its walls or freely, never in front of a door, never half a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sim.building import Bounds, Box, Solid
from sim.generators import furniture as f
from sim.generators.spaces import DOOR_M, Opening, Space

Rectangles = NDArray[np.float64]
"""(n, 4) low x, low y, high x, high y in metres."""

GAP_M = 0.7
"""Two things either touch or leave this much: a gap is plainly passable or plainly none."""
TOUCH_M = 1e-6
DOOR_DEPTH_M = 1.0
"""Floor kept clear on either side of a doorway."""
COVER = (0.075, 0.115)
"""A room is filled until its furniture stands on a share of the floor drawn from here."""
MOST_COVER = 0.145
LEAST_COVER = 0.055
FIRST_ATTEMPTS = 30
ATTEMPTS = 80
ROOM_ATTEMPTS = 10


@dataclass(frozen=True)
class Taste:
    """What belongs into a room of one kind."""

    at_walls: tuple[f.Maker, ...]
    freely: tuple[f.Maker, ...] = ()
    first_at_wall: tuple[f.Maker, ...] = ()  # the first of these that fits
    first_freely: tuple[f.Maker, ...] = ()


TASTES: dict[str, Taste] = {
    "office": Taste((f.desk, f.desk, f.cabinet, f.bookcase, f.wall_table), (), (f.desk, f.small_desk)),
    "open plan": Taste((f.cabinet, f.bookcase), (f.desk_island, f.table_with_chairs), (), (f.desk_island,)),
    "meeting": Taste((f.sideboard, f.cabinet), (f.table_with_chairs,), (), (f.table_with_chairs,)),
    "kitchen": Taste((f.fridge, f.cabinet, f.wall_table), (), (f.counter, f.fridge), (f.table_with_chairs,)),
    "store": Taste((f.rack, f.rack, f.cabinet, f.wall_table), (), (f.rack,)),
    "lounge": Taste(
        (f.sofa, f.sideboard, f.armchair), (f.coffee_table, f.table_with_chairs), (f.sofa,), (f.coffee_table,)
    ),
    "living": Taste(
        (f.sofa, f.sideboard, f.bookcase, f.armchair), (f.coffee_table,), (f.sofa,), (f.table_with_chairs,)
    ),
    "bedroom": Taste(
        (f.wardrobe, f.bookcase, f.small_desk, f.wall_table), (), (f.bed, f.plain_bed, f.single_bed)
    ),
    "study": Taste((f.bookcase, f.cabinet, f.armchair, f.wall_table), (), (f.desk, f.small_desk)),
    "bath": Taste((f.wash_stand, f.washing_machine, f.toilet), (), (f.bath_tub, f.shower)),
    "stock": Taste((f.rack, f.cabinet), (f.pallet, f.table_with_chairs), (f.rack,)),
}


@dataclass
class Furnishing:
    """One room being furnished: what stands already, and what must stay clear."""

    floor: Bounds
    keep_clear: Rectangles  # before and behind doors
    standing: Rectangles = field(default_factory=lambda: np.empty((0, 4)))  # around each piece
    solids: list[Solid] = field(default_factory=list)
    covered_m2: float = 0.0

    @property
    def area_m2(self) -> float:
        x0, y0, x1, y1 = self.floor
        return (x1 - x0) * (y1 - y0)

    @property
    def cover(self) -> float:
        """The share of the floor that furniture stands on."""
        return self.covered_m2 / self.area_m2

    def add(self, piece: f.Piece, low: tuple[float, float], quarter_turns: int) -> bool:
        """Stand a piece with its lower-left corner at low, if nothing speaks against it."""
        width, depth = piece.width_m, piece.depth_m
        size = (width, depth) if quarter_turns % 2 == 0 else (depth, width)
        bounds = (low[0], low[1], low[0] + size[0], low[1] + size[1])
        if self.covered_m2 + piece.area_m2() > MOST_COVER * self.area_m2:
            return False
        gaps_m = _gaps(bounds, self.standing)
        if (_gaps(bounds, self.keep_clear) < 0.0).any():
            return False
        if not ((gaps_m >= GAP_M - TOUCH_M) | (np.abs(gaps_m) < TOUCH_M)).all():
            return False
        self.standing = np.vstack((self.standing, bounds))
        self.covered_m2 += piece.area_m2()
        self.solids += [_turned(solid, piece, low, quarter_turns) for solid in piece.solids]
        return True


def furnish(space: Space, openings: Sequence[Opening], rng: np.random.Generator) -> list[Solid]:
    """Furniture for a room of this kind; an empty list if it would not even cover LEAST_COVER."""
    zones = door_zones(space, openings)
    for _ in range(ROOM_ATTEMPTS):
        room = Furnishing(space.floor(), zones)
        fill(room, TASTES[space.kind], rng.uniform(*COVER), rng)
        if room.cover >= LEAST_COVER:
            return room.solids
    return []


def fill(room: Furnishing, taste: Taste, cover: float, rng: np.random.Generator) -> None:
    """First what the room is for, then whatever else suits it until enough of the floor is covered."""
    for makers, place in ((taste.first_freely, add_freely), (taste.first_at_wall, add_along_wall)):
        any(place(room, maker(rng), rng) for maker in makers for _ in range(FIRST_ATTEMPTS))
    for _ in range(ATTEMPTS):
        if room.cover >= cover:
            return
        if taste.freely and rng.random() < 0.4:
            add_freely(room, one_of(taste.freely, rng), rng)
        else:
            add_along_wall(room, one_of(taste.at_walls, rng), rng)


def one_of(makers: Sequence[f.Maker], rng: np.random.Generator) -> f.Piece:
    """A piece of a kind drawn from these."""
    return makers[int(rng.integers(len(makers)))](rng)


def add_along_wall(room: Furnishing, piece: f.Piece, rng: np.random.Generator) -> bool:
    """Try one place with the piece's back at a wall: in a corner, beside another piece, or anywhere."""
    x0, y0, x1, y1 = room.floor
    side = int(rng.integers(4))  # quarter turns of the piece: its back to the south, east, north, west
    length, depth = (x1 - x0, y1 - y0) if side % 2 == 0 else (y1 - y0, x1 - x0)
    spare = length - piece.width_m
    if spare < 0.0 or depth - piece.depth_m < GAP_M:
        return False
    along = [0.0, spare]
    if spare > 2.0 * GAP_M:
        along += [round(rng.uniform(GAP_M, spare - GAP_M), 2) for _ in range(2)]
    if len(room.standing):
        low_x, low_y, high_x, high_y = room.standing[int(rng.integers(len(room.standing)))].tolist()
        a, b = (low_x - x0, high_x - x0) if side % 2 == 0 else (low_y - y0, high_y - y0)
        along += [b, a - piece.width_m]
    s = along[rng.integers(len(along))]
    if not (s == 0.0 or s == spare or GAP_M <= s <= spare - GAP_M):
        return False
    low = {
        0: (x0 + s, y0),
        1: (x1 - piece.depth_m, y0 + s),
        2: (x0 + s, y1 - piece.depth_m),
        3: (x0, y0 + s),
    }[side]
    return room.add(piece, low, side)


def add_freely(room: Furnishing, piece: f.Piece, rng: np.random.Generator) -> bool:
    """Try one place away from the walls."""
    x0, y0, x1, y1 = room.floor
    turns = int(rng.integers(2))
    size = (piece.width_m, piece.depth_m) if turns == 0 else (piece.depth_m, piece.width_m)
    spare = (x1 - x0 - size[0] - 2.0 * GAP_M, y1 - y0 - size[1] - 2.0 * GAP_M)
    if min(spare) < 0.0:
        return False
    low = [round(o + GAP_M + rng.uniform(0.0, s), 2) for o, s in zip((x0, y0), spare, strict=True)]
    return room.add(piece, (max(low[0], x0 + GAP_M), max(low[1], y0 + GAP_M)), turns)


def door_zones(space: Space, openings: Sequence[Opening]) -> Rectangles:
    """The floor before and behind each doorway in this space's walls."""
    zones = []
    half = 0.5 * DOOR_M + 0.15
    x0, y0, x1, y1 = space.x0, space.y0, space.x1, space.y1
    for opening in openings:
        middle, at = 0.5 * (opening.low + opening.high), opening.wall.at
        if opening.wall.is_along_x and at in (y0, y1) and x0 < middle < x1:
            zones.append((middle - half, at - DOOR_DEPTH_M, middle + half, at + DOOR_DEPTH_M))
        if not opening.wall.is_along_x and at in (x0, x1) and y0 < middle < y1:
            zones.append((at - DOOR_DEPTH_M, middle - half, at + DOOR_DEPTH_M, middle + half))
    return np.array(zones).reshape(-1, 4)


def _gaps(bounds: Bounds, others: Rectangles) -> NDArray[np.float64]:
    """(n,) metres to other rectangles along the axis that parts them most; negative where they overlap."""
    x0, y0, x1, y1 = bounds
    apart = (x0 - others[:, 2], others[:, 0] - x1, y0 - others[:, 3], others[:, 1] - y1)
    return np.maximum.reduce(apart)


def _turned(solid: Solid, piece: f.Piece, low: tuple[float, float], quarter_turns: int) -> Solid:
    """A piece's solid in the world, after counter-clockwise quarter turns of the piece."""
    u, v, w, d = solid.x_m, solid.y_m, piece.width_m, piece.depth_m
    x, y = {0: (u, v), 1: (d - v, u), 2: (w - u, d - v), 3: (v, w - u)}[quarter_turns]
    placed = replace(solid, x_m=round(low[0] + x, 6), y_m=round(low[1] + y, 6))
    if isinstance(placed, Box) and quarter_turns % 2 == 1:
        return replace(placed, half_x_m=placed.half_y_m, half_y_m=placed.half_x_m)
    return placed
