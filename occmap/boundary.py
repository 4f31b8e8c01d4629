"""A polygon outside of which nothing is explored and nowhere is driven."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier
from occmap.geometry import Points
from occmap.grid import OccupancyGrid, flat_inside

Corners = Sequence[tuple[float, float]]
"""Metres, in order, the last joined to the first."""

BAND_M = 0.3
"""No way leads across a closed band this wide along the outer side, not even for a robot that was pushed into
it."""
TOUCHING_M = 1e-9
"""A side that ends this near to another touches it: one corner may stand on a side, crossing is a mistake."""


def polygon(corners: Corners) -> Points:
    """(n, 2) the corners, counter-clockwise. ValueError if they enclose nothing, or sides cross."""
    points = np.array(corners, np.float64).reshape(-1, 2)
    if len(points) < 3 or not np.isfinite(points).all():
        raise ValueError(f"a boundary needs at least three corners, finite, got {tuple(corners)}")
    for side, other in crossings(points):
        ends = (points[k % len(points)].tolist() for k in (side, side + 1, other, other + 1))
        raise ValueError(
            "the boundary's sides {}-{} and {}-{} cross: give its corners in order".format(*ends)
        )
    (x, y), (next_x, next_y) = points.T, np.roll(points, -1, axis=0).T
    twice_area = float(np.sum(x * next_y - next_x * y))
    if twice_area == 0.0:
        raise ValueError(f"a boundary must enclose an area, got corners on one line: {tuple(corners)}")
    return points if twice_area > 0.0 else points[::-1].copy()


def crossings(corners: Points) -> NDArray[np.intp]:
    """(k, 2) pairs of sides that cross, each known by its first corner. O(n^2)."""
    along = np.roll(corners, -1, axis=0) - corners
    offset = corners[None, :] - corners[:, None]  # of each corner from the beginning of each side
    twice_area = along[:, None, 0] * offset[..., 1] - along[:, None, 1] * offset[..., 0]
    is_off = np.abs(twice_area) > TOUCHING_M * np.hypot(*along.T)[:, None]
    on = np.sign(twice_area) * is_off  # on which hand of the side
    parts = on * np.roll(on, -1, axis=1) < 0.0
    return np.argwhere(np.triu(parts & parts.T))


def are_within(corners: Points, places: Points) -> NDArray[np.bool_]:
    """(n,) whether places (n, 2) lie in a polygon: a ray from there crosses an odd number of its sides."""
    x, y = places[:, 0], places[:, 1]
    inside = np.zeros(len(places), bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        spans = (y0 > y) != (y1 > y)
        inside ^= spans & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside


class Boundary:
    """The polygon in the map's frame. Remembers which cells it closes, until the grid grows."""

    def __init__(self, corners_in_map: Corners) -> None:
        self.corners = polygon(corners_in_map)
        if not are_within(self.corners, np.zeros((1, 2)))[0]:
            raise ValueError("the boundary must hold the place where the robot starts")
        self._closed: NDArray[np.int32] = np.empty(0, np.int32)
        self._closed_in: tuple[object, ...] | None = None  # the grid's extent that goes with it

    def split(
        self, frontiers: Sequence[Frontier], grid: OccupancyGrid
    ) -> tuple[list[Frontier], list[Frontier]]:
        """The frontiers within, and those beyond; one that the boundary cuts is found, in part, in both.

        All of their cells at once: a window shows a thousand of them beyond.
        """
        if not frontiers:
            return [], []
        within: list[Frontier] = []
        beyond: list[Frontier] = []
        cells = np.concatenate([frontier.cells for frontier in frontiers])
        inside = are_within(self.corners, grid.frame.map_from_cell(cells))
        ends = np.cumsum([len(frontier.cells) for frontier in frontiers])
        for frontier, is_in in zip(frontiers, np.split(inside, ends[:-1]), strict=True):
            n = np.count_nonzero(is_in)
            if n == len(is_in):
                within.append(frontier)
            elif n == 0:
                beyond.append(frontier)
            else:
                within.append(_part(frontier, is_in, grid))
                beyond.append(_part(frontier, ~is_in, grid))
        return within, beyond

    def closed_cells(self, grid: OccupancyGrid) -> NDArray[np.int32]:
        """(n,) flat indices of the band's cells."""
        extent = grid.offset, grid.shape, grid.frame.resolution_m
        if extent != self._closed_in:
            band = grid.frame.cell_from_map(self._band(0.5 * grid.frame.resolution_m))
            self._closed = flat_inside(band, grid.shape).astype(np.int32)
            self._closed_in = extent
        return self._closed

    def _band(self, spacing_m: float) -> Points:
        """(n, 2) places along the sides, row beside row from just within to BAND_M beyond."""
        away_m = np.arange(-0.5 * spacing_m, BAND_M, spacing_m)
        rows = []
        for start, end in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            length_m = math.dist(start, end)
            if length_m == 0.0:
                continue
            along = (end - start) / length_m
            outward = np.array([along[1], -along[0]])  # the inside is on the left
            reach_m = np.arange(0.0, length_m + spacing_m, spacing_m)
            rows.append(start + reach_m[:, None, None] * along + away_m[None, :, None] * outward)
        return np.concatenate([row.reshape(-1, 2) for row in rows])


def _part(frontier: Frontier, mask: NDArray[np.bool_], grid: OccupancyGrid) -> Frontier:
    cells = frontier.cells[mask]
    x_m, y_m = grid.frame.map_from_cell(cells).mean(axis=0).tolist()
    return replace(frontier, cells=cells, centroid_in_map=(x_m, y_m), size=len(cells))
