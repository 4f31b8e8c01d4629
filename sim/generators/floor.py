"""Spaces and openings -> a furnished Building, checked: the start reaches all rooms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from occmap.geometry import Pose2
from sim.building import Building, Room, Solid
from sim.generators.furnish import furnish
from sim.generators.sketch import Sketch
from sim.generators.spaces import Opening, Space, doors_of, walls_of
from sim.starts import BODY_RADIUS_M, largest_region, random_start
from sim.truth import configuration_space, truth_grid

REACHED = 0.9
"""The share of a room's configuration space that must be connected with the start."""
CHECK_CELL_M = 0.05
COARSE_CHECK_CELL_M = 0.1
LARGE_M2 = 2500.0
"""Above this floor area a building is checked on coarse cells."""

Size = tuple[float, float]
Filler = Callable[[Space, Sequence[Opening], np.random.Generator], list[Solid]]
"""Furnishes one space; an empty list if that did not work out."""


def furnished(
    kind: str,
    size_m: Size,
    sketch: Sketch,
    rng: np.random.Generator,
    fillers: Mapping[str, Filler] | None = None,
) -> Building | None:
    """Walls, doors, furniture and a start; None if a room stays bare or out of reach."""
    spaces, openings = sketch.spaces, sketch.openings(rng)
    solids: list[Solid] = list(walls_of(spaces, openings))
    for space in spaces:
        if space.is_room:
            fill = (fillers or {}).get(space.kind, furnish)
            furniture = fill(space, openings, rng)
            if not furniture:
                return None
            solids += furniture
    building = Building(
        name=kind,
        kind=kind,
        low_m=(0.0, 0.0),
        high_m=size_m,
        solids=tuple(solids),
        start=Pose2.identity(),
        rooms=named_rooms(spaces),
        doors=tuple(doors_of(openings)),
    )
    return entered(building, rng)


def named_rooms(spaces: Sequence[Space]) -> tuple[Room, ...]:
    """The spaces that are rooms, numbered within their kind."""
    count: Counter[str] = Counter()
    rooms = []
    for space in spaces:
        if space.is_room:
            count[space.kind] += 1
            x0, y0, x1, y1 = space.floor()
            rooms.append(Room(f"{space.kind} {count[space.kind]}", (x0, y0), (x1, y1)))
    return tuple(rooms)


def entered(building: Building, rng: np.random.Generator) -> Building | None:
    """The building with a random start in its largest region; None if a room is not part of that."""
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    cell_m = CHECK_CELL_M if (x1 - x0) * (y1 - y0) <= LARGE_M2 else COARSE_CHECK_CELL_M
    truth = truth_grid(building, cell_m)
    space = configuration_space(truth, BODY_RADIUS_M)
    region = largest_region(space)
    for room in building.rooms:
        (ix0, iy0), (ix1, iy1) = truth.cell_from_world(np.array([room.low_m, room.high_m]))
        inside = slice(iy0, iy1), slice(ix0, ix1)
        if not region[inside].any() or region[inside].sum() < REACHED * space[inside].sum():
            return None
    if not region.any():
        return None
    return replace(building, start=random_start(truth, region, rng))
