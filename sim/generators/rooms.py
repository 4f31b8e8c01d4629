"""Rooms: overlapping rectangles and wide corridors on a coarse raster, without furniture.

Like the maps that explorers are commonly compared on in papers: large, blocky and bare. In corridors as wide
as these it matters most in which order a robot looks at things: a point robot needs a seventh less by a
tour than by the nearest frontier, in corridors of 2 to 4 m a sixteenth less.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

from occmap.geometry import Pose2
from sim.building import Building, Room
from sim.generators.floor import Size, entered
from sim.walls import boxes_of

CELL_M = 0.4
"""Walls lie on a raster of this pitch."""
FLOOR_PER_ROOM_M2 = 200.0
"""One room to so much of the building, overlaps and all."""
SIDE_M = (6.0, 12.0)
"""The least and the greatest side of a room."""
CORRIDOR_M = (4.0, 6.0)
"""The least and the greatest width of a corridor."""
LOOPS = 0.25
"""So many corridors more than a tree needs, per room."""

Mask = NDArray[np.bool_]
Rectangle = tuple[int, int, int, int]
"""Half-open, in cells: ix0, iy0, ix1, iy1."""


def rooms(size_m: Size, rng: np.random.Generator) -> Building | None:
    """Rectangles thrown at random, joined by corridors; None if this draw did not work out.

    A side that is no multiple of the raster loses what is left over.
    """
    nx, ny = (math.floor(side / CELL_M + 1e-9) for side in size_m)
    drawn = [draw_room(nx, ny, rng) for _ in range(max(2, round(size_m[0] * size_m[1] / FLOOR_PER_ROOM_M2)))]
    free = np.zeros((ny, nx), bool)
    for ix0, iy0, ix1, iy1 in drawn:
        free[iy0:iy1, ix0:ix1] = True
    for a, b in joined_pairs(drawn, rng):
        dig_corridor(free, middle(drawn[a]), middle(drawn[b]), rng)
    return entered(building_of(free, drawn, size_m), rng)


def draw_room(nx: int, ny: int, rng: np.random.Generator) -> Rectangle:
    """A rectangle that leaves one cell of wall around the building."""
    least, most = (round(side / CELL_M) for side in SIDE_M)
    width, height = (int(rng.integers(min(least, n - 2), min(most, n - 2) + 1)) for n in (nx, ny))
    ix, iy = int(rng.integers(1, nx - width)), int(rng.integers(1, ny - height))
    return ix, iy, ix + width, iy + height


def middle(room: Rectangle) -> tuple[int, int]:
    """The cell in the middle of a rectangle."""
    return (room[0] + room[2]) // 2, (room[1] + room[3]) // 2


def joined_pairs(drawn: list[Rectangle], rng: np.random.Generator) -> list[tuple[int, int]]:
    """Which rooms a corridor joins: the shortest tree between their middles, and some loops."""
    places = np.array([middle(room) for room in drawn], float)
    away = cdist(places, places, "cityblock") + 1.0  # a tree in csgraph takes 0 for no edge at all
    tree = [(int(a), int(b)) for a, b in zip(*minimum_spanning_tree(away).nonzero(), strict=True)]
    for a in rng.permutation(len(drawn))[: round(LOOPS * len(drawn))]:
        third = np.argsort(away[a], kind="stable")[min(3, len(drawn) - 1)]
        tree.append((int(a), int(third)))
    return tree


def dig_corridor(free: Mask, a: tuple[int, int], b: tuple[int, int], rng: np.random.Generator) -> None:
    """Free an L from a to b, as wide all along: first along one axis, then along the other."""
    least, most = (round(width / CELL_M) for width in CORRIDOR_M)
    width = int(rng.integers(least, most + 1))
    corner = (b[0], a[1]) if rng.random() < 0.5 else (a[0], b[1])
    ny, nx = free.shape
    for (x0, y0), (x1, y1) in ((a, corner), (corner, b)):
        left, low = max(1, min(x0, x1) - width // 2), max(1, min(y0, y1) - width // 2)
        right, high = max(x0, x1) - width // 2 + width, max(y0, y1) - width // 2 + width
        free[low : min(high, ny - 1), left : min(right, nx - 1)] = True


def building_of(free: Mask, drawn: list[Rectangle], size_m: Size) -> Building:
    """The raster as boxes, everything that is not free solid."""
    solids = boxes_of(~free, CELL_M, (0.0, 0.0))
    named = tuple(
        Room(f"room {k}", (ix0 * CELL_M, iy0 * CELL_M), (ix1 * CELL_M, iy1 * CELL_M))
        for k, (ix0, iy0, ix1, iy1) in enumerate(drawn, 1)
    )
    return Building("rooms", "rooms", (0.0, 0.0), size_m, tuple(solids), Pose2.identity(), named)
