"""Offices: corridors with rooms on both sides, cross corridors that close loops, dead ends, suites."""

from __future__ import annotations

import numpy as np

from sim.building import Building
from sim.generators.floor import Size, furnished
from sim.generators.ladder import LadderConfig, ladder, spine
from sim.generators.sketch import Sketch

LEAST_ROOMS = 10
LOOP_SIZE_M = (12.0, 10.0)
"""A smaller floor has no space for a loop and so many rooms."""
ROOMY_M2 = 24.0
"""Larger rooms are shared by many."""


def office(size_m: Size, rng: np.random.Generator) -> Building | None:
    """A furnished office floor; None if this draw did not work out."""
    width, height = size_m
    is_turned = height > width or (height >= 18.0 and rng.random() < 0.3)
    long, short = (height, width) if is_turned else size_m
    if long < LOOP_SIZE_M[0] or short < LOOP_SIZE_M[1]:
        sketch = spine((long, short), LadderConfig(), rng)
    else:
        sketch = ladder((long, short), LadderConfig(), rng)
        if len(sketch.rooms()) < LEAST_ROOMS:
            return None
    assign_rooms(sketch, rng)
    return furnished("office", size_m, sketch.transposed() if is_turned else sketch, rng)


def assign_rooms(sketch: Sketch, rng: np.random.Generator) -> None:
    """Large rooms are open-plan offices, lounges and meeting rooms; of the others most are offices."""
    small = []
    for room in rng.permutation(sketch.rooms()):
        if area_m2(sketch, room) > ROOMY_M2:
            sketch.use(room, str(rng.choice(["open plan", "open plan", "meeting", "lounge"])))
        else:
            small.append(room)
    kinds = (
        ["kitchen"] * (1 + len(small) // 20)
        + ["meeting"] * (len(small) // 6)
        + ["store"] * (1 + len(small) // 9)
    )
    for k, room in enumerate(small):
        sketch.use(room, kinds[k] if k < len(kinds) else "office")


def area_m2(sketch: Sketch, room: int) -> float:
    """The floor of one room."""
    x0, y0, x1, y1 = sketch.spaces[room].floor()
    return (x1 - x0) * (y1 - y0)
