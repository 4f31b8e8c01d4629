"""Floors of parallel corridors joined by cross corridors, with rows of rooms between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sim.generators.spaces import WALL_M, Opening, Space, doorway, mouth

LEAST_ROOM_M = 2.1
"""No room is narrower, from the middle of one wall to the middle of the next."""

KindOf = Callable[[float, np.random.Generator], str]
"""area in m² -> what a room of that size is for."""


@dataclass(frozen=True)
class LadderConfig:
    """The proportions of a floor."""

    corridor_m: tuple[float, float] = (1.65, 2.05)
    """Width of a corridor, from the middle of one wall to the middle of the other."""
    row_depth_m: tuple[float, float] = (3.4, 6.0)
    """How deep rooms would like to be."""
    room_width_m: tuple[float, float] = (2.8, 5.2)
    """How wide rooms would like to be."""
    wing_m: float = 13.0
    """There is a cross corridor about every so many metres."""
    suite_share: float = 0.22
    """Rooms that are entered through the room beside them instead of from the corridor."""
    second_door_share: float = 0.15
    """Rooms with another door: to their neighbour, or to the corridor behind them."""


@dataclass(frozen=True)
class Bands:
    """How the depth of a floor is divided: rows of rooms and corridors, from y = 0 upwards."""

    corridors: int
    inner_rows: int  # rows of rooms between two corridors
    row_depth_m: float


def ladder(
    size_m: tuple[float, float], config: LadderConfig, kind_of: KindOf, rng: np.random.Generator
) -> tuple[list[Space], list[Opening]]:
    """Spaces and openings of a floor whose long corridors run along x."""
    low, high = 0.5 * WALL_M, [side - 0.5 * WALL_M for side in size_m]
    corridor_m = round(rng.uniform(*config.corridor_m), 2)
    if min(size_m) < 14.0:
        corridor_m = 1.5
    bands = choose_bands(high[1] - low, corridor_m, config, rng)
    crossings = place_crossings(low, high[0], corridor_m, config, rng)
    halls: list[Space] = []
    rows: list[tuple[list[Space], list[Space]]] = []
    openings: list[Opening] = []
    y = low
    below: Space | None = None
    for k in range(bands.corridors + 1):
        last = k == bands.corridors
        n_rows = 1 if k == 0 or last else bands.inner_rows
        top = high[1] if last else round(y + n_rows * bands.row_depth_m, 3)
        above = None if last else Space("corridor", low, top, high[0], round(top + corridor_m, 3))
        cuts: list[tuple[float, float]] = []
        if below is not None and above is not None:
            for x in crossings_of_band(crossings, rng):
                cross = Space("corridor", x, y, round(x + corridor_m, 3), top)
                openings += [m for m in (mouth(cross, below), mouth(cross, above)) if m]
                halls.append(cross)
                cuts.append((cross.x0, cross.x1))
        edges = [y, top] if n_rows == 1 else [y, round(0.5 * (y + top), 3), top]
        for j in range(n_rows):
            corridors = [
                c for c, beside in ((below, j == 0), (above, j == n_rows - 1)) if c is not None and beside
            ]
            for x0, x1 in blocks(low, high[0], cuts):
                rows.append((row_of_rooms(x0, x1, edges[j], edges[j + 1], config, kind_of, rng), corridors))
        if above is not None:
            halls.append(above)
            y = above.y1
        below = above
    for rooms, corridors in rows:
        openings += doors_of_row(rooms, corridors, config, rng)
    return halls + [room for rooms, _ in rows for room in rooms], openings


def choose_bands(depth_m: float, corridor_m: float, config: LadderConfig, rng: np.random.Generator) -> Bands:
    """One of the divisions that give rows of a pleasant depth, or the one that comes nearest to it."""
    options = []
    for corridors in range(2, 3 + int(depth_m / (2.0 * config.row_depth_m[0]))):
        for inner in (1, 2):
            row = (depth_m - corridors * corridor_m) / (2 + inner * (corridors - 1))
            if row >= LEAST_ROOM_M:
                options.append(Bands(corridors, inner, row))
    if not options:
        raise ValueError(f"{depth_m:.1f} m is too shallow for two corridors and three rows of rooms")
    low, high = config.row_depth_m
    pleasant = [b for b in options if low <= b.row_depth_m <= high]
    if pleasant:
        return pleasant[rng.integers(len(pleasant))]
    return min(options, key=lambda b: abs(b.row_depth_m - 0.5 * (low + high)))


def place_crossings(
    low: float, high: float, corridor_m: float, config: LadderConfig, rng: np.random.Generator
) -> list[float]:
    """Where cross corridors begin: two at least, so that there is a loop, with rooms at both ends."""
    n = max(2, round((high - low) / config.wing_m))
    wing = (high - low - n * corridor_m) / (n + 1)
    if wing < LEAST_ROOM_M:
        raise ValueError(
            f"{high - low:.1f} m is too narrow for two cross corridors and the rooms between them"
        )
    shift = min(0.25 * wing, wing - LEAST_ROOM_M) * 0.5
    return [round(low + (k + 1) * wing + k * corridor_m + rng.uniform(-shift, shift), 2) for k in range(n)]


def crossings_of_band(crossings: Sequence[float], rng: np.random.Generator) -> list[float]:
    """The cross corridors that one band keeps: all of few, most of many, never less than two."""
    chosen = [x for x in crossings if rng.random() < 0.8]
    return chosen if len(chosen) >= 2 else list(crossings)


def blocks(low: float, high: float, cuts: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The stretches between cross corridors."""
    edges = [low, *(x for cut in sorted(cuts) for x in cut), high]
    return list(zip(edges[::2], edges[1::2], strict=True))


def row_of_rooms(
    x0: float,
    x1: float,
    y0: float,
    y1: float,
    config: LadderConfig,
    kind_of: KindOf,
    rng: np.random.Generator,
) -> list[Space]:
    """Rooms side by side, of unequal widths."""
    n = max(1, round((x1 - x0) / rng.uniform(*config.room_width_m)))
    while n > 1 and (x1 - x0) / n < LEAST_ROOM_M:
        n -= 1
    spare = (x1 - x0) - n * LEAST_ROOM_M
    widths = LEAST_ROOM_M + spare * rng.dirichlet(np.full(n, 4.0))
    edges = [x0, *(round(x0 + float(w), 2) for w in np.cumsum(widths)[:-1]), x1]
    return [
        Space(kind_of((b - a) * (y1 - y0), rng), a, y0, b, y1)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]


def doors_of_row(
    rooms: Sequence[Space], corridors: Sequence[Space], config: LadderConfig, rng: np.random.Generator
) -> list[Opening]:
    """Each room gets a door to a corridor, or, as the inner part of a suite, to the room beside it."""
    found: list[Opening | None] = []
    is_inner = False
    for k, room in enumerate(rooms):
        corridor = corridors[rng.integers(len(corridors))]
        is_inner = k > 0 and not is_inner and rng.random() < config.suite_share
        found.append(doorway(room, rooms[k - 1] if is_inner else corridor, rng))
        if rng.random() < config.second_door_share:
            others = [c for c in corridors if c is not corridor] or (
                [rooms[k - 1]] if k > 0 and not is_inner else []
            )
            found += [doorway(room, other, rng) for other in others]
    return [opening for opening in found if opening is not None]
