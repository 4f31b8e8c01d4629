"""Apartments: a hallway that ends in the living room, kitchen beside it, bedrooms and baths along it."""

from __future__ import annotations

import numpy as np

from sim.building import Building
from sim.generators.floor import Size, furnished
from sim.generators.ladder import LadderConfig, add_row, ladder
from sim.generators.office import area_m2
from sim.generators.sketch import Sketch
from sim.generators.spaces import WALL_M, Space

HALLWAY_M = 1.45
"""Width of the hallway, from the middle of one wall to the middle of the other."""
DEEP_M = 14.0
"""A floor whose short side is longer than this has more than one hallway."""
ROOMS = LadderConfig(room_width_m=(3.2, 4.8), row_depth_m=(3.2, 5.0), suite_share=0.15)
BATH_M = (2.2, 2.8)
"""How wide a bath is."""
BEDROOM_M2 = 12.0
"""A bed does not leave enough floor in smaller rooms."""
BATHS = 5
"""Of the rooms along a hallway, the smallest one in so many is another bath."""
LIVINGS = 7
"""And the largest one in so many a living room or a kitchen."""


def apartment(size_m: Size, rng: np.random.Generator) -> Building | None:
    """A furnished apartment; None if this draw did not work out."""
    width, height = max(size_m), min(size_m)
    if height > DEEP_M:
        sketch = ladder((width, height), ROOMS, rng)
        assign_rooms(sketch, sketch.rooms(), rng)
    else:
        sketch = around_a_hallway(width, height, rng)
    if rng.random() < 0.5:
        sketch = sketch.mirrored(width)
    if rng.random() < 0.5:
        sketch = sketch.transposed().mirrored(height).transposed()
    return furnished("apartment", size_m, sketch.transposed() if size_m[1] > size_m[0] else sketch, rng)


def around_a_hallway(width: float, height: float, rng: np.random.Generator) -> Sketch:
    """Living room and kitchen at the western end, the other rooms along both sides of the hallway."""
    low, x_high, y_high = 0.5 * WALL_M, width - 0.5 * WALL_M, height - 0.5 * WALL_M
    x_living = round(low + (x_high - low) * rng.uniform(0.34, 0.44), 2)
    y_hall = round(low + (y_high - low - HALLWAY_M) * rng.uniform(0.42, 0.58), 2)
    y_kitchen = round(y_hall - rng.uniform(0.0, 0.12) * (y_hall - low), 2)
    y_top = round(y_hall + HALLWAY_M, 3)
    sketch = Sketch()
    hallway = sketch.add(Space("corridor", x_living, y_hall, x_high, y_top))
    living = sketch.add(Space("living", low, y_kitchen, x_living, y_high))
    kitchen = sketch.add(Space("kitchen", low, low, x_living, y_kitchen))
    sketch.doors += [(living, hallway), (living, kitchen)]
    x_bath = round(x_living + rng.uniform(*BATH_M), 2)
    bath = sketch.add(Space("bath", x_living, low, x_bath, y_hall))
    lower = add_row(sketch, (x_bath, x_high), (low, y_hall), ROOMS, rng)
    upper = add_row(sketch, (x_living, x_high), (y_top, y_high), ROOMS, rng)
    sketch.doors += [(room, hallway) for room in (bath, *lower, *upper)]
    if rng.random() < 0.5:
        sketch.doors.append((living, upper[0]))  # a loop through the room beside the living room
    assign_rooms(sketch, lower + upper, rng)
    return sketch


def assign_rooms(sketch: Sketch, rooms: list[int], rng: np.random.Generator) -> None:
    """Bedrooms and studies; of many rooms the smallest are baths, the largest living rooms and kitchens."""
    by_area = sorted(rooms, key=lambda room: area_m2(sketch, room))
    for k, room in enumerate(by_area):
        is_largest = room == by_area[-1]
        fits_a_bed = area_m2(sketch, room) > BEDROOM_M2
        kind = "bedroom" if fits_a_bed and (is_largest or rng.random() < 0.8) else "study"
        if k < len(rooms) // BATHS:
            kind = "bath"
        elif not is_largest and len(rooms) - k <= 1 + len(rooms) // LIVINGS and len(rooms) >= LIVINGS:
            kind = "kitchen" if k % 2 else "living"
        sketch.use(room, kind)
