"""What the explorer remembers besides the map: looks that failed, and where it once could go."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.decision import Reason
from occmap.geometry import Points, Pose2
from occmap.grid import Belief, GridFrame, OccupancyGrid, moved

if TYPE_CHECKING:
    from occmap.frontiers import Frontier
    from occmap.goals import Goal
    from occmap.planner import Wavefront

SAME_PLACE_M = 0.5
"""Frontiers whose centroids are nearer to each other are taken for one, if there is no wall between."""
SURROUNDINGS_M = 1.0
"""A look depends on what is known within a square that reaches this far from the frontier."""
CHANGED_SHARE = 0.1
"""If more of that square has become known or unknown, the look may go otherwise today."""
CUT_OFF_M2 = 0.5
"""Losing more than this in one piece of what was once reachable means being sealed in."""


@dataclass(frozen=True, slots=True)
class Look:
    """A frontier, or a nook, that was looked into."""

    in_map: tuple[float, float]  # one place on the frontier, near its middle
    centroid_in_map: tuple[float, float]
    known_cells: int  # within SURROUNDINGS_M of the place, afterwards


@dataclass(frozen=True, slots=True)
class FailedLook(Look):
    """A look that was had, or driven to, in vain."""

    reason: Reason
    why: str


L = TypeVar("L", bound=Look)


class FailedLooks:
    """Frontiers looked at in vain; forgotten where the map around them has changed since."""

    def __init__(self) -> None:
        self._looks: list[FailedLook] = []

    def note(self, goal: Goal, reason: Reason, why: str, grid: OccupancyGrid) -> None:
        """Remember a look in vain."""
        for watched in (goal.watched_in_map, *goal.also_watched_in_map):
            self._looks.append(FailedLook(*look_fields(watched, grid), reason, why))

    def at(self, frontier: Frontier, grid: OccupancyGrid) -> list[FailedLook]:
        """The looks that failed here and still count, oldest first."""
        return still_there(self._looks, frontier, SAME_PLACE_M, grid)

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._looks = carried(self._looks, new_map_from_old_map)


def still_there(looks: Sequence[L], frontier: Frontier, within_m: float, grid: OccupancyGrid) -> list[L]:
    """Those looks that were had where a frontier lies and still count, in their order. O(looks)."""
    near = [look for look in looks if math.dist(look.centroid_in_map, frontier.centroid_in_map) < within_m]
    if not near:
        return []
    places = grid.frame.map_from_cell(frontier.cells)
    return [
        look
        for look in near
        if are_joined(look.in_map, nearest(places, look.in_map), grid)
        and not has_changed_around(look.in_map, look.known_cells, grid)
    ]


def look_fields(watched: Points, grid: OccupancyGrid) -> tuple[tuple[float, float], tuple[float, float], int]:
    """Fields of a Look, from the places (n, 2) that stand for its frontier."""
    x_m, y_m = watched.mean(axis=0).tolist()
    place = nearest(watched, (x_m, y_m))
    return place, (x_m, y_m), known_around(place, grid)


def carried(looks: Sequence[L], new_map_from_old_map: Pose2) -> list[L]:
    """The same looks after a correction of the map."""
    old = np.array([(look.in_map, look.centroid_in_map) for look in looks]).reshape(-1, 2)
    new = new_map_from_old_map.apply(old).reshape(-1, 2, 2).tolist()
    return [
        replace(look, in_map=tuple(place), centroid_in_map=tuple(centroid))
        for look, (place, centroid) in zip(looks, new, strict=True)
    ]


def are_joined(a: tuple[float, float], b: tuple[float, float], grid: OccupancyGrid) -> bool:
    """Whether no wall is between a place and a frontier cell: what is behind it is another frontier."""
    from occmap.goals_kernels import sees  # compiled on first use, not on import

    cell = grid.frame.cell_at(*a)
    if not grid.contains(*cell):
        return False
    return sees(grid.state, *cell, *grid.frame.cell_at(*b), grid.state.size)


def nearest(places: Points, to: tuple[float, float]) -> tuple[float, float]:
    """The nearest of some places (n, 2) to another."""
    x_m, y_m = places[np.argmin(((places - to) ** 2).sum(axis=1))].tolist()
    return x_m, y_m


def has_changed_around(place: tuple[float, float], known_cells: int, grid: OccupancyGrid) -> bool:
    """Whether much has become known or unknown around a place since so many cells were known there."""
    changed = abs(known_around(place, grid) - known_cells)
    return changed > CHANGED_SHARE * (2.0 * SURROUNDINGS_M / grid.frame.resolution_m) ** 2


def known_around(place: tuple[float, float], grid: OccupancyGrid) -> int:
    """Known cells of the square around a place that a look there depends on."""
    reach = max(1, round(SURROUNDINGS_M / grid.frame.resolution_m))
    ix, iy = grid.frame.cell_at(*place)
    window = grid.state[max(0, iy - reach) : max(0, iy + reach), max(0, ix - reach) : max(0, ix + reach)]
    return int(np.count_nonzero(window))


class ReachMemory:
    """Free space that the belief once called reachable: how a robot tells that it was sealed in."""

    def __init__(self) -> None:
        self._offset = (0, 0)
        self._reached: NDArray[np.uint8] = np.empty((0, 0), np.uint8)

    def note(self, wave: Wavefront, grid: OccupancyGrid) -> None:
        """Remember what a flood has reached. O(cells reached)."""
        self._align(grid)
        self._reached.ravel()[wave.reached_cells()] = 1

    def is_cut_off(self, wave: Wavefront, grid: OccupancyGrid, roomy: NDArray[np.bool_]) -> bool:
        """Whether a piece of floor once reached, still free and roomy, is shut off from what a flood reaches.

        Roomy: with space for the body, (ny, nx). Cells along walls come and go with noise. Shut off: no
        free cells lead there at all; a gap that turned out too narrow for the body has not been closed.
        """
        self._align(grid)
        cost, exact_below = wave.raw_costs()
        is_free = grid.state == Belief.FREE
        lost = is_free & roomy & (self._reached != 0) & (cost >= exact_below)
        if np.count_nonzero(lost) * grid.frame.resolution_m**2 <= CUT_OFF_M2:
            return False  # whatever the pieces: labelling a large map takes long
        pieces = np.empty(grid.shape, np.int32)
        ndimage.label(is_free, output=pieces)
        pieces[np.isin(pieces, np.unique(pieces[cost < exact_below]))] = 0
        pieces[(self._reached == 0) | ~roomy] = 0
        largest = np.bincount(pieces.ravel())[1:].max(initial=0)
        return float(largest) * grid.frame.resolution_m**2 > CUT_OFF_M2

    def carry_over(self, new_map_from_old_map: Pose2, grid: OccupancyGrid) -> None:
        """Follow a correction of the map onto another grid of the same resolution."""
        from occmap.reach_kernels import carry  # compiled on first use, not on import

        r = grid.frame.resolution_m
        old_frame = GridFrame(r, (self._offset[0] * r, self._offset[1] * r))
        first = new_map_from_old_map.apply(np.array([old_frame.centre_of(0, 0)]))
        (x0, y0), yaw = grid.frame.in_cells(first)[0].tolist(), new_map_from_old_map.yaw_rad
        reached = np.zeros(grid.shape, np.uint8)
        carry(self._reached, reached, math.cos(yaw), math.sin(yaw), x0, y0)
        self._reached = reached
        self._offset = grid.offset

    def _align(self, grid: OccupancyGrid) -> None:
        if self._offset != grid.offset or self._reached.shape != grid.shape:
            self._reached = moved(self._reached, self._offset, grid.offset, grid.shape, np.uint8(0))
            self._offset = grid.offset
