"""Floors of parallel corridors joined by cross corridors, with rows of rooms between them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.generators.sketch import Sketch
from sim.generators.spaces import WALL_M, Space

LEAST_ROOM_M = 2.1
"""No room is narrower, from the middle of one wall to the middle of the next."""
SMALL_M = 14.0
"""Floors with a shorter side than this have narrow corridors."""
SMALL_CORRIDOR_M = 1.5

Interval = tuple[float, float]


@dataclass(frozen=True)
class LadderConfig:
    """The proportions of a floor. Widths and depths run from the middle of one wall to the next."""

    corridor_m: Interval = (1.65, 2.05)
    """Width of a corridor."""
    row_depth_m: Interval = (3.4, 6.0)
    """How deep rooms would like to be."""
    room_width_m: Interval = (2.8, 5.2)
    """How wide rooms would like to be."""
    wing_m: float = 13.0
    """There is a cross corridor about every so many metres."""
    suite_share: float = 0.22
    """Rooms that are entered through the room beside them instead of from the corridor."""
    second_door_share: float = 0.15
    """Rooms with another door: to their neighbour, or to the corridor behind them."""


@dataclass(frozen=True)
class Bands:
    """How the depth of a floor is divided: one row of rooms at either edge, corridors, rows between them."""

    corridors: int
    inner_rows: int  # rows of rooms between two corridors
    corridor_m: float
    row_depth_m: float

    def rows_of(self, band: int) -> int:
        """Rows of rooms in a band; bands 0 and `corridors` lie at the edges."""
        return 1 if band in (0, self.corridors) else self.inner_rows

    def levels(self, low: float, high: float) -> list[Interval]:
        """From where to where each band reaches; a corridor lies between each and the next."""
        levels, y = [], low
        for band in range(self.corridors):
            top = round(y + self.rows_of(band) * self.row_depth_m, 3)
            levels.append((y, top))
            y = round(top + self.corridor_m, 3)
        return [*levels, (y, high)]


def ladder(size_m: tuple[float, float], config: LadderConfig, rng: np.random.Generator) -> Sketch:
    """A floor whose long corridors run along x from wall to wall; they end dead beyond the last crossing."""
    low, x_high, y_high = 0.5 * WALL_M, size_m[0] - 0.5 * WALL_M, size_m[1] - 0.5 * WALL_M
    corridor_m = SMALL_CORRIDOR_M if min(size_m) < SMALL_M else round(rng.uniform(*config.corridor_m), 2)
    bands = choose_bands(y_high - low, corridor_m, config, rng)
    crossings = place_crossings(low, x_high, corridor_m, config, rng)
    levels = bands.levels(low, y_high)
    sketch = Sketch()
    corridors = [
        sketch.add(Space("corridor", low, below[1], x_high, above[0]))
        for below, above in itertools.pairwise(levels)
    ]
    for band, (y0, y1) in enumerate(levels):
        beside = [k for k in (band - 1, band) if 0 <= k < len(corridors)]
        cuts = []
        if len(beside) == 2:
            for x in crossings_of_band(crossings, rng):
                cross = sketch.add(Space("corridor", x, y0, round(x + corridor_m, 3), y1))
                sketch.mouths += [(cross, corridors[k]) for k in beside]
                cuts.append((x, round(x + corridor_m, 3)))
        edges = [y0, y1] if bands.rows_of(band) == 1 else [y0, round(0.5 * (y0 + y1), 3), y1]
        for row in itertools.pairwise(edges):
            near = [corridors[k] for k in beside if sketch.spaces[corridors[k]].y1 == row[0]]
            near += [corridors[k] for k in beside if sketch.spaces[corridors[k]].y0 == row[1]]
            for block in blocks(low, x_high, cuts):
                join_row(sketch, add_row(sketch, block, row, config, rng), near, config, rng)
    return sketch


def spine(size_m: tuple[float, float], config: LadderConfig, rng: np.random.Generator) -> Sketch:
    """A floor too small for a ladder: one corridor along x, a row of rooms on either side, no loop."""
    low, x_high, y_high = 0.5 * WALL_M, size_m[0] - 0.5 * WALL_M, size_m[1] - 0.5 * WALL_M
    y0 = round(0.5 * (low + y_high - SMALL_CORRIDOR_M), 2)
    y1 = round(y0 + SMALL_CORRIDOR_M, 2)
    sketch = Sketch()
    corridor = sketch.add(Space("corridor", low, y0, x_high, y1))
    for row in ((low, y0), (y1, y_high)):
        join_row(sketch, add_row(sketch, (low, x_high), row, config, rng), [corridor], config, rng)
    return sketch


def choose_bands(depth_m: float, corridor_m: float, config: LadderConfig, rng: np.random.Generator) -> Bands:
    """One of the divisions that give rows of a pleasant depth, or the one that comes nearest to it."""
    options = []
    for corridors in range(2, 3 + int(depth_m / (2.0 * config.row_depth_m[0]))):
        for inner in (1, 2):
            row_m = (depth_m - corridors * corridor_m) / (2 + inner * (corridors - 1))
            if row_m >= LEAST_ROOM_M:
                options.append(Bands(corridors, inner, corridor_m, row_m))
    if not options:
        raise ValueError(f"{depth_m:.1f} m is too shallow for two corridors and three rows of rooms")
    low, high = config.row_depth_m
    pleasant = [b for b in options if low <= b.row_depth_m <= high]
    if pleasant:
        return pleasant[int(rng.integers(len(pleasant)))]
    return min(options, key=lambda b: abs(b.row_depth_m - 0.5 * (low + high)))


def place_crossings(
    low: float, high: float, corridor_m: float, config: LadderConfig, rng: np.random.Generator
) -> list[float]:
    """Where cross corridors begin: two at least, so that there is a loop, with rooms at both ends."""
    n = max(2, round((high - low) / config.wing_m))
    wing_m = (high - low - n * corridor_m) / (n + 1)
    if wing_m < LEAST_ROOM_M:
        raise ValueError(
            f"{high - low:.1f} m is too narrow for two cross corridors and the rooms between them"
        )
    shift = 0.5 * min(0.5 * wing_m, wing_m - LEAST_ROOM_M)
    return [round(low + (k + 1) * wing_m + k * corridor_m + rng.uniform(-shift, shift), 2) for k in range(n)]


def crossings_of_band(crossings: Sequence[float], rng: np.random.Generator) -> list[float]:
    """The cross corridors that one band keeps: all of few, most of many, never less than two."""
    chosen = [x for x in crossings if rng.random() < 0.8]
    return chosen if len(chosen) >= 2 else list(crossings)


def blocks(low: float, high: float, cuts: Sequence[Interval]) -> list[Interval]:
    """The stretches between cross corridors."""
    edges = [low, *itertools.chain(*cuts), high]
    return list(zip(edges[::2], edges[1::2], strict=True))


def add_row(
    sketch: Sketch, block: Interval, row: Interval, config: LadderConfig, rng: np.random.Generator
) -> list[int]:
    """Rooms side by side, of unequal widths."""
    length = block[1] - block[0]
    n = max(1, min(round(length / rng.uniform(*config.room_width_m)), int(length / LEAST_ROOM_M)))
    widths = LEAST_ROOM_M + (length - n * LEAST_ROOM_M) * rng.dirichlet(np.full(n, 4.0))
    edges = [block[0], *(round(block[0] + float(w), 2) for w in np.cumsum(widths)[:-1]), block[1]]
    return [sketch.add(Space("room", a, row[0], b, row[1])) for a, b in itertools.pairwise(edges)]


def join_row(
    sketch: Sketch,
    rooms: Sequence[int],
    corridors: Sequence[int],
    config: LadderConfig,
    rng: np.random.Generator,
) -> None:
    """Each room gets a door to a corridor, or, as the inner part of a suite, to the room beside it."""
    is_inner = False
    for k, room in enumerate(rooms):
        corridor = corridors[int(rng.integers(len(corridors)))]
        is_inner = k > 0 and not is_inner and rng.random() < config.suite_share
        sketch.doors.append((room, rooms[k - 1] if is_inner else corridor))
        if rng.random() < config.second_door_share:
            others = [c for c in corridors if c != corridor] or [rooms[k - 1]] * (k > 0 and not is_inner)
            sketch.doors += [(room, other) for other in others]
