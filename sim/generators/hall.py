"""Halls: rows of shelves, columns on a grid, packing tables and pallets, small rooms in a corner."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.building import Building, Cylinder, Solid
from sim.generators import furniture as f
from sim.generators.floor import Size, furnished
from sim.generators.furnish import LEAST_COVER, Furnishing, add_along_wall, add_freely, door_zones
from sim.generators.ladder import Interval
from sim.generators.sketch import Sketch
from sim.generators.spaces import WALL_M, Opening, Space

SHELF_DEPTHS_M = (0.9, 1.1, 1.3)
SHELF_LENGTH_M = (4.0, 9.0)
"""A row of shelves runs about so far before a cross aisle."""
AISLE_M = (2.2, 3.2)
"""Between two rows."""
CROSS_AISLE_M = 2.4
BAY_M = 5.5
"""Columns stand about so far apart."""
COLUMN_RADIUS_M = (0.2, 0.25, 0.3)
COVER = (0.08, 0.12)
"""The share of the floor under shelves, columns and goods."""
COLUMN_SHIFTS_M = (0.0, 0.6, -0.6, 1.2, -1.2, 1.8, -1.8)
"""A column that would leave half a gap moves this far along its row."""
SHELF_SHARE = 0.75
"""Of what covers the floor, so much is shelves."""
PACKING_ATTEMPTS = 50
"""Each hall should have at least one packing table."""
SIDE_ROOM_M = (3.2, 4.6)


def hall(size_m: Size, rng: np.random.Generator) -> Building | None:
    """A furnished hall; None if this draw did not work out."""
    low, x_high, y_high = 0.5 * WALL_M, size_m[0] - 0.5 * WALL_M, size_m[1] - 0.5 * WALL_M
    sketch = Sketch()
    depth_m = round(rng.uniform(*SIDE_ROOM_M), 2)
    x_rooms = round(low + depth_m, 3)
    edges = [low, *np.round(low + np.cumsum(rng.uniform(*SIDE_ROOM_M, size=2)), 2).tolist()]
    floor = sketch.add(Space("hall", x_rooms, low, x_high, y_high))
    yard = sketch.add(Space("corridor", low, edges[-1], x_rooms, y_high))
    sketch.mouths.append((floor, yard))
    for kind, y0, y1 in (("office", edges[0], edges[1]), ("stock", edges[1], edges[2])):
        sketch.doors.append((sketch.add(Space(kind, low, y0, x_rooms, y1)), floor))
    if rng.random() < 0.5:
        sketch = sketch.mirrored(size_m[0])
    return furnished("hall", size_m, sketch, rng, {"hall": fill_hall})


def fill_hall(space: Space, openings: Sequence[Opening], rng: np.random.Generator) -> list[Solid]:
    """Rows of shelves, columns on a grid, then goods until enough of the floor is covered."""
    room = Furnishing(space.floor(), door_zones(space, openings))
    target = rng.uniform(*COVER)
    rows = add_shelves(room, SHELF_SHARE * target, rng)
    add_columns(room, rows, rng)
    any(add_freely(room, f.table_with_chairs(rng), rng) for _ in range(PACKING_ATTEMPTS))
    goods = (f.pallet, f.pallet, f.table_with_chairs, f.desk_island)
    for _ in range(int(room.area_m2)):
        if room.cover >= target:
            break
        maker = goods[int(rng.integers(len(goods)))]
        place = add_along_wall if maker is f.pallet and rng.random() < 0.5 else add_freely
        place(room, maker(rng), rng)
    return room.solids if room.cover >= LEAST_COVER else []


def add_shelves(room: Furnishing, cover: float, rng: np.random.Generator) -> list[float]:
    """Rows of shelves along x with aisles between them, broken by cross aisles; some are left out.

    Returns the middle lines of the rows.
    """
    x0, y0, x1, y1 = room.floor
    depth = float(rng.choice(SHELF_DEPTHS_M))
    aisle = rng.uniform(*AISLE_M)
    lows = [
        round(y0 + aisle + k * (depth + aisle), 2) for k in range(int((y1 - y0 - aisle) / (depth + aisle)))
    ]
    runs = runs_between(x0 + CROSS_AISLE_M, x1 - CROSS_AISLE_M, rng.uniform(*SHELF_LENGTH_M))
    places = [(low, high, y) for y in lows for low, high in runs]
    for k in rng.permutation(len(places)):
        low, high, y = places[k]
        if room.cover < cover:
            room.add(f.block(round(high - low, 2), depth, 1.0, "shelf"), (round(low, 2), y), 0)
    return [y + 0.5 * depth for y in lows]


def add_columns(room: Furnishing, rows: Sequence[float], rng: np.random.Generator) -> None:
    """Columns at the joints of equal bays, moved into the rows of shelves, so that aisles stay clear."""
    x0, y0, x1, y1 = room.floor
    radius = float(rng.choice(COLUMN_RADIUS_M))
    column = f.Piece(2.0 * radius, 2.0 * radius, (Cylinder(radius, radius, radius, 1.0, "column"),))
    middles = sorted({min(rows, key=lambda row: abs(row - y)) for y in joints(y0, y1, BAY_M)}) if rows else []
    for x in joints(x0, x1, BAY_M):
        for y in middles:
            places = ((round(x + shift - radius, 3), round(y - radius, 3)) for shift in COLUMN_SHIFTS_M)
            any(room.add(column, place, 0) for place in places)


def joints(low: float, high: float, pitch: float) -> list[float]:
    """Inner joints of equal bays of about this pitch."""
    n = max(1, round((high - low) / pitch))
    return [low + k * (high - low) / n for k in range(1, n)]


def runs_between(low: float, high: float, length: float) -> list[Interval]:
    """Stretches of about this length with cross aisles between them."""
    n = max(1, math.floor((high - low + CROSS_AISLE_M) / (length + CROSS_AISLE_M)))
    each = (high - low - (n - 1) * CROSS_AISLE_M) / n
    return [(low + k * (each + CROSS_AISLE_M), low + k * (each + CROSS_AISLE_M) + each) for k in range(n)]
