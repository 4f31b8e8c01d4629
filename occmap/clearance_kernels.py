"""Kernels of the clearance map: an exact Euclidean distance transform, mended flip by flip.

Two layers are kept: the distance along each column to its nearest obstacle (in cells), and the
distance in the plane, which follows from a row of the former (Felzenszwalb and Huttenlocher 2012 do
the same in two passes over a whole image). An obstacle that appears only lowers distances within
its disc. One that vanishes concerns only the cells that it was the nearest obstacle to: those whose
distance equals theirs to it. So the cost follows the flips, not the box that spans them.
"""

from __future__ import annotations

import numpy as np

from occmap.grid import OCCUPIED
from occmap.kernel import kernel, part


@kernel
def take_flips(flat_cells, was, state, column, distance, by_squares, disc):
    """Bring the layers in step with a state some of whose cells flipped.

    flat_cells (n,) int32 and was (n,) uint8 say which cells changed state and from what; column
    (ny, nx) uint8 and distance (ny, nx) float32 are the layers; by_squares[d2] is the distance at
    d2 squared cells, its last entry the truncation; disc (2 radius + 1)^2 the distances around one
    obstacle. O(radius^2) for each cell that became or ceased to be occupied.
    """
    nx = state.shape[1]
    for k in range(flat_cells.shape[0]):
        iy, ix = flat_cells[k] // nx, flat_cells[k] % nx
        if (was[k] == OCCUPIED) != (state[iy, ix] == OCCUPIED):
            mend_column(ix, iy, state, column, disc.shape[0] // 2)
    for k in range(flat_cells.shape[0]):
        iy, ix = flat_cells[k] // nx, flat_cells[k] % nx
        if was[k] == OCCUPIED and state[iy, ix] != OCCUPIED:
            forget_obstacle(ix, iy, column, distance, by_squares, disc)
    for k in range(flat_cells.shape[0]):
        iy, ix = flat_cells[k] // nx, flat_cells[k] % nx
        if was[k] != OCCUPIED and state[iy, ix] == OCCUPIED:
            add_obstacle(ix, iy, distance, disc)


@part
def mend_column(ix, iy, state, column, radius):
    """Distances along the column, in cells and up to radius, around a cell that flipped. O(radius)."""
    ny = state.shape[0]
    low, high = max(iy - radius, 0), min(iy + radius, ny - 1)
    gap = radius
    for y in range(low - radius, high + 1):
        gap = 0 if y >= 0 and state[y, ix] == OCCUPIED else min(gap + 1, radius)
        if y >= low:
            column[y, ix] = gap
    gap = radius
    for y in range(high + radius, low - 1, -1):
        gap = 0 if y < ny and state[y, ix] == OCCUPIED else min(gap + 1, radius)
        if y <= high:
            column[y, ix] = min(np.uint8(gap), column[y, ix])


@part
def add_obstacle(ix, iy, distance, disc):
    """Lower the distances around a cell that became occupied. O(radius^2), vectorised by rows."""
    radius = disc.shape[0] // 2
    ny, nx = distance.shape
    x0, x1 = max(ix - radius, 0), min(ix + radius + 1, nx)
    for y in range(max(iy - radius, 0), min(iy + radius + 1, ny)):
        row = distance[y, x0:x1]
        near = disc[y - iy + radius, x0 - ix + radius : x1 - ix + radius]
        for i in range(row.shape[0]):
            row[i] = near[i] if near[i] < row[i] else row[i]


@part
def forget_obstacle(ix, iy, column, distance, by_squares, disc):
    """Measure anew the cells whose nearest obstacle may have been one that vanished.

    O(radius^2) to find them, O(radius) for each.
    """
    radius = disc.shape[0] // 2
    ny, nx = distance.shape
    x0, x1 = max(ix - radius, 0), min(ix + radius + 1, nx)
    beyond = by_squares[-1]
    for y in range(max(iy - radius, 0), min(iy + radius + 1, ny)):
        row = distance[y, x0:x1]
        near = disc[y - iy + radius, x0 - ix + radius : x1 - ix + radius]
        for i in range(row.shape[0]):
            if row[i] == near[i] and near[i] < beyond:
                row[i] = measure(x0 + i, y, column, by_squares, radius)


@part
def measure(ix, iy, column, by_squares, radius):
    """The distance of one cell from the column distances along its row. O(radius)."""
    x0, x1 = max(ix - radius, 0), min(ix + radius + 1, column.shape[1])
    row = column[iy, x0:x1]
    best = by_squares.shape[0] - 1
    for i in range(row.shape[0]):
        across, along = x0 + i - ix, np.int64(row[i])
        best = min(best, across * across + along * along)
    return by_squares[best]
