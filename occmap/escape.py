"""The way out of a place where no path may start: inside inflation, or on an island made by noise."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from occmap.search import SearchMemory, SearchRequest
from occmap.terrain import Terrain


def way_out(
    memory: SearchMemory,
    terrain: Terrain,
    start_cell: tuple[int, int],
    escape_prices: NDArray[np.int32],
    radius_m: float,
) -> NDArray[np.int32] | None:
    """(k,) flat cells from the start to the nearest cell of the largest open piece within radius_m.

    None if the start is on that piece, or if there is none. The way may cross any cell that is not
    occupied: a robot that stands among them has fitted so far; it does not cross walls.
    """
    from occmap.planner_kernels import STRAIGHT, walk_back

    start = terrain.flat(start_cell)
    dearest = float(escape_prices.max()) / STRAIGHT
    memory.search(terrain, start, escape_prices, SearchRequest.flood(terrain, None, None, radius_m * dearest))
    near = np.sort(memory.touched[: memory.n_touched])
    nx = terrain.shape[1]
    away = np.hypot(near % nx - start_cell[0], near // nx - start_cell[1]) * terrain.frame.resolution_m
    near = near[away <= radius_m]

    piece, size = _pieces_around(terrain, start_cell, near, radius_m)
    if not size.any():
        return None
    main = piece[np.argmax(size)]
    if piece[near == start][0] == main:
        return None
    candidates = near[piece == main]
    return walk_back(int(candidates[np.argmin(memory.cost[candidates])]), nx, memory.link, start)


def _pieces_around(
    terrain: Terrain, centre: tuple[int, int], cells: NDArray[np.int32], radius_m: float
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Which 4-connected piece of open ground each of some flat cells is on (0 none), and how large that is.

    Pieces are measured within three times the radius: far enough to tell an island from a room.
    """
    from scipy.ndimage import label

    reach = math.ceil(3.0 * radius_m / terrain.frame.resolution_m)
    x0, y0 = max(centre[0] - reach, 0), max(centre[1] - reach, 0)
    window = np.s_[y0 : centre[1] + reach + 1, x0 : centre[0] + reach + 1]
    is_open = terrain.is_open(window)
    labels = np.zeros(is_open.shape, np.int32)
    label(is_open, output=labels)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    nx = terrain.shape[1]
    piece = labels[cells // nx - y0, cells % nx - x0]
    return piece, sizes[piece]
