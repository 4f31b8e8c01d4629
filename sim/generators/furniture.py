"""Pieces of furniture: solids in a frame of their own.

u runs along the wall behind the piece, v away from it, and (0, 0) is its left rear corner. All of
them stand on the floor and reach above the lidar; a table is seen by its legs, and a robot drives
between them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.building import Box, Building, Cylinder, Solid

LEG_RADIUS_M = 0.02
CHAIR_RADIUS_M = 0.22


@dataclass(frozen=True, slots=True)
class Piece:
    """Solids within the rectangle (0, 0) to (width, depth)."""

    width_m: float
    depth_m: float
    solids: tuple[Solid, ...]

    def area_m2(self) -> float:
        """Floor that its solids stand on."""
        return sum(footprint_m2(solid) for solid in self.solids)


Maker = Callable[[np.random.Generator], Piece]


def footprint_m2(solid: Solid) -> float:
    """The floor under one solid."""
    if isinstance(solid, Box):
        return 4.0 * solid.half_x_m * solid.half_y_m
    return float(np.pi) * solid.radius_m**2


def block(width_m: float, depth_m: float, height_m: float, kind: str = "furniture") -> Piece:
    """A box with its back to the wall: a cabinet, a bed, a sofa."""
    return Piece(width_m, depth_m, (_box(0.0, 0.0, width_m, depth_m, height_m, kind),))


def _box(u: float, v: float, width: float, depth: float, height_m: float, kind: str = "furniture") -> Box:
    return Box(u + 0.5 * width, v + 0.5 * depth, 0.5 * width, 0.5 * depth, 0.0, height_m, kind)


def legs(u: float, v: float, width: float, depth: float, height_m: float) -> tuple[Cylinder, ...]:
    """Four thin legs at the corners of a table's top."""
    r = LEG_RADIUS_M
    return tuple(Cylinder(u + a, v + b, r, height_m) for a in (r, width - r) for b in (r, depth - r))


def has_thin_legs(building: Building) -> bool:
    """Whether any table stands in it."""
    return any(isinstance(s, Cylinder) and s.radius_m == LEG_RADIUS_M for s in building.solids)


def chair(u: float, v: float) -> Cylinder:
    """A swivel chair: its foot fills a circle."""
    return Cylinder(u, v, CHAIR_RADIUS_M, 0.5)


def some(low: float, high: float, step: float = 0.1) -> Callable[[np.random.Generator], float]:
    """A size from a range, in steps as furniture is sold."""
    return lambda rng: round(low + step * int(rng.integers(round((high - low) / step) + 1)), 3)


def cabinet(rng: np.random.Generator) -> Piece:
    return block(some(0.8, 1.6)(rng), 0.45, 1.0)


def bookcase(rng: np.random.Generator) -> Piece:
    return block(some(0.8, 2.0, 0.4)(rng), 0.35, 1.0)


def desk(rng: np.random.Generator) -> Piece:
    """A desk with its drawers, and a chair pushed to it."""
    width = some(1.4, 1.8)(rng)
    sitter = chair(round(0.5 * width + rng.uniform(-0.1, 0.1), 3), 0.9)
    return Piece(width, 1.12, (_box(0.0, 0.0, width, 0.75, 0.72), sitter))


def small_desk(rng: np.random.Generator) -> Piece:
    return Piece(1.2, 0.94, (_box(0.0, 0.0, 1.2, 0.6, 0.72), chair(0.6, 0.72)))


def desk_island(rng: np.random.Generator) -> Piece:
    """Desks face to face, people on both sides."""
    n = int(rng.integers(1, 3))
    seats = tuple(chair(0.8 + 1.6 * k, v) for k in range(n) for v in (0.22, 2.14))
    return Piece(1.6 * n, 2.36, (_box(0.0, 0.4, 1.6 * n, 1.56, 0.72), *seats))


def table_with_chairs(rng: np.random.Generator) -> Piece:
    """A table on four legs with chairs along both sides, all of it wide enough to drive between."""
    n = int(rng.integers(1, 3))
    width = 1.84 if n == 1 else 3.2
    seats = (0.5,) if n == 1 else (0.3, 0.7)
    chairs = tuple(chair(round(width * s, 3), v) for s in seats for v in (0.22, 1.54))
    return Piece(width, 1.76, (*legs(0.0, 0.43, width, 0.9, 0.74), *chairs))


def wall_table(rng: np.random.Generator) -> Piece:
    """A table on four legs, pushed to the wall."""
    width = some(1.0, 1.6)(rng)
    return Piece(width, 0.8, legs(0.0, 0.0, width, 0.8, 0.74))


def coffee_table(rng: np.random.Generator) -> Piece:
    return Piece(1.2, 0.8, legs(0.0, 0.0, 1.2, 0.8, 0.45))


def counter(rng: np.random.Generator) -> Piece:
    return block(some(1.8, 3.0, 0.6)(rng), 0.6, 0.9)


def fridge(rng: np.random.Generator) -> Piece:
    return block(0.6, 0.65, 1.0)


def rack(rng: np.random.Generator) -> Piece:
    return block(some(1.0, 2.0, 0.5)(rng), 0.5, 1.0, "shelf")


def sofa(rng: np.random.Generator) -> Piece:
    return block(some(1.6, 2.4, 0.2)(rng), 0.9, 0.75)


def armchair(rng: np.random.Generator) -> Piece:
    return block(0.85, 0.85, 0.75)


def sideboard(rng: np.random.Generator) -> Piece:
    return block(some(1.4, 2.0, 0.2)(rng), 0.4, 0.6)


def bed(rng: np.random.Generator) -> Piece:
    """A double bed, its head at the wall, with a bedside table on either side."""
    width = some(1.4, 1.8, 0.2)(rng)
    tables = _box(0.0, 0.0, 0.4, 0.4, 0.5), _box(0.4 + width, 0.0, 0.4, 0.4, 0.5)
    return Piece(width + 0.8, 2.05, (_box(0.4, 0.0, width, 2.05, 0.55), *tables))


def plain_bed(rng: np.random.Generator) -> Piece:
    return block(1.4, 2.0, 0.5)


def single_bed(rng: np.random.Generator) -> Piece:
    """Its long side at the wall."""
    return block(1.95, 0.85, 0.5)


def wardrobe(rng: np.random.Generator) -> Piece:
    return block(some(1.0, 2.0, 0.5)(rng), 0.6, 1.0)


def bath_tub(rng: np.random.Generator) -> Piece:
    return block(1.7, 0.75, 0.55)


def wash_stand(rng: np.random.Generator) -> Piece:
    return block(some(0.6, 1.0)(rng), 0.5, 0.85)


def washing_machine(rng: np.random.Generator) -> Piece:
    return block(0.6, 0.6, 0.85)


def toilet(rng: np.random.Generator) -> Piece:
    return block(0.4, 0.65, 0.45)


def shower(rng: np.random.Generator) -> Piece:
    return block(0.8, 0.8, 1.0)


def pallet(rng: np.random.Generator) -> Piece:
    return block(1.2, 0.8, some(0.4, 1.0)(rng))
