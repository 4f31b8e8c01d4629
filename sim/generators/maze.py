"""Mazes: every place is reached from every other, mostly in one way, with some loops and a few chambers."""

from __future__ import annotations

from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from sim.building import Box, Building, Room
from sim.generators.floor import Size, entered

PITCH_M = 1.25
"""From the middle of one passage to the middle of the next, about."""
WALL_M = 0.1
LOOPS = 0.06
"""The share of the walls left after carving that is taken out again, each opening a loop."""
CHAMBER_M2 = 130.0
"""One chamber, a room of 2 x 2 cells without walls inside, to so much floor."""

Walls = NDArray[np.bool_]


def maze(size_m: Size, rng: np.random.Generator) -> Building | None:
    """A maze in a box of walls, without furniture."""
    nx, ny = (max(2, round((side - WALL_M) / PITCH_M)) for side in size_m)
    west, south = carve(nx, ny, rng)
    chambers = open_chambers(west, south, max(1, round(size_m[0] * size_m[1] / CHAMBER_M2)), rng)
    x = np.round(np.linspace(0.5 * WALL_M, size_m[0] - 0.5 * WALL_M, nx + 1), 3)
    y = np.round(np.linspace(0.5 * WALL_M, size_m[1] - 0.5 * WALL_M, ny + 1), 3)
    walls = [_wall(x[ix], x[ix], y[a], y[b]) for ix in range(nx + 1) for a, b in stretches(west[:, ix])]
    walls += [_wall(x[a], x[b], y[iy], y[iy]) for iy in range(ny + 1) for a, b in stretches(south[iy])]
    half = 0.5 * WALL_M
    rooms = tuple(
        Room(
            f"chamber {k}",
            (round(float(x[ix]) + half, 6), round(float(y[iy]) + half, 6)),
            (round(float(x[ix + 2]) - half, 6), round(float(y[iy + 2]) - half, 6)),
        )
        for k, (ix, iy) in enumerate(chambers, 1)
    )
    empty = Building("maze", "maze", (0.0, 0.0), size_m, tuple(walls), Pose2.identity(), rooms)
    return entered(empty, rng)


def carve(nx: int, ny: int, rng: np.random.Generator) -> tuple[Walls, Walls]:
    """Depth-first carving (recursive backtracker), then a few walls less.

    Returns west (ny, nx + 1) and south (ny + 1, nx): whether there is a wall at those sides of the cells.
    """
    west, south = np.ones((ny, nx + 1), bool), np.ones((ny + 1, nx), bool)
    visited = np.zeros((ny, nx), bool)
    trail = [(int(rng.integers(nx)), int(rng.integers(ny)))]
    visited[trail[0][1], trail[0][0]] = True
    while trail:
        ix, iy = trail[-1]
        ahead = [
            (jx, jy)
            for jx, jy in ((ix + 1, iy), (ix - 1, iy), (ix, iy + 1), (ix, iy - 1))
            if 0 <= jx < nx and 0 <= jy < ny and not visited[jy, jx]
        ]
        if not ahead:
            trail.pop()
            continue
        jx, jy = ahead[int(rng.integers(len(ahead)))]
        if jy == iy:
            west[iy, max(ix, jx)] = False
        else:
            south[max(iy, jy), ix] = False
        visited[jy, jx] = True
        trail.append((jx, jy))
    west[:, 1:-1] &= rng.random((ny, nx - 1)) >= LOOPS
    south[1:-1] &= rng.random((ny - 1, nx)) >= LOOPS
    return west, south


def open_chambers(west: Walls, south: Walls, count: int, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Take the walls out of some blocks of 2 x 2 cells that do not touch; returns their lower-left cells."""
    ny, nx = west.shape[0], south.shape[1]
    chambers: list[tuple[int, int]] = []
    for _ in range(20 * count):
        ix, iy = int(rng.integers(nx - 1)), int(rng.integers(ny - 1))
        if len(chambers) < count and all(max(abs(ix - jx), abs(iy - jy)) > 2 for jx, jy in chambers):
            west[iy : iy + 2, ix + 1] = False
            south[iy + 1, ix : ix + 2] = False
            chambers.append((ix, iy))
    return chambers


def stretches(walls: Walls) -> list[tuple[int, int]]:
    """Runs of wall in one line, from joint a to joint b."""
    runs, at = [], 0
    for is_wall, run in groupby(walls.tolist()):
        end = at + len(list(run))
        if is_wall:
            runs.append((at, end))
        at = end
    return runs


def _wall(x0: float, x1: float, y0: float, y1: float) -> Box:
    half = 0.5 * WALL_M
    return Box(
        round(float(x0 + x1) / 2, 6),
        round(float(y0 + y1) / 2, 6),
        round(float(x1 - x0) / 2 + half, 6),
        round(float(y1 - y0) / 2 + half, 6),
    )
