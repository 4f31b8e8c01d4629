"""What the explorer remembers besides the map: looks that failed, and where it once could go."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.decision import Reason
from occmap.geometry import Points, Pose2
from occmap.grid import Belief, OccupancyGrid, moved

if TYPE_CHECKING:
    from occmap.frontiers import Frontier
    from occmap.planner import Wavefront


@dataclass(frozen=True, slots=True)
class FailedLook:
    """A frontier that was looked at, or driven to, in vain."""

    in_map: tuple[float, float]
    reason: Reason
    why: str
    known_cells: int  # within SURROUNDINGS_M of it at the time


SAME_PLACE_M = 0.5
"""Frontiers whose centroids are nearer to each other are taken for one."""
SURROUNDINGS_M = 1.0
"""A look depends on what is known within a square that reaches this far from the frontier."""
CHANGED_SHARE = 0.1
"""If more of that square has become known or unknown, the look may go otherwise today."""
CUT_OFF_M2 = 0.5
"""Losing more than this in one piece of what was once reachable means being sealed in."""


class FailedLooks:
    """Frontiers looked at in vain; forgotten where the map around them has changed since."""

    def __init__(self) -> None:
        self._looks: list[FailedLook] = []

    def note(self, frontier: Frontier, reason: Reason, why: str, grid: OccupancyGrid) -> None:
        place = frontier.centroid_in_map
        self._looks.append(FailedLook(place, reason, why, _known_around(place, grid)))

    def at(self, frontier: Frontier, grid: OccupancyGrid) -> list[FailedLook]:
        """The looks that failed here and still count, oldest first."""
        x, y = frontier.centroid_in_map
        near = [k for k in self._looks if math.hypot(k.in_map[0] - x, k.in_map[1] - y) < SAME_PLACE_M]
        return [k for k in near if not self._is_outdated(k, grid)]

    def _is_outdated(self, look: FailedLook, grid: OccupancyGrid) -> bool:
        changed = abs(_known_around(look.in_map, grid) - look.known_cells)
        return changed > CHANGED_SHARE * (2.0 * SURROUNDINGS_M / grid.frame.resolution_m) ** 2

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._looks = [
            FailedLook(_carried(k.in_map, new_map_from_old_map), k.reason, k.why, k.known_cells)
            for k in self._looks
        ]


def _carried(place: tuple[float, float], new_from_old: Pose2) -> tuple[float, float]:
    points: Points = new_from_old.apply(np.array([place]))
    return float(points[0, 0]), float(points[0, 1])


def _known_around(place: tuple[float, float], grid: OccupancyGrid) -> int:
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
        """Whether a piece of floor once reached, still free and roomy, is shut off from all that a flood reaches.

        Roomy: with space for the body, (ny, nx). Cells along walls come and go with noise. Shut off: no
        free cells lead there at all; a gap that turned out too narrow for the body has not been closed.
        """
        self._align(grid)
        cost, exact_below = wave.fixed_point()
        pieces = np.empty(grid.shape, np.int32)
        ndimage.label(grid.state == Belief.FREE, output=pieces)
        pieces[np.isin(pieces, np.unique(pieces[cost < exact_below]))] = 0
        pieces[(self._reached == 0) | ~roomy] = 0
        largest = np.bincount(pieces.ravel())[1:].max(initial=0)
        return float(largest) * grid.frame.resolution_m**2 > CUT_OFF_M2

    def _align(self, grid: OccupancyGrid) -> None:
        if self._offset != grid.offset or self._reached.shape != grid.shape:
            self._reached = moved(self._reached, self._offset, grid.offset, grid.shape, np.uint8(0))
            self._offset = grid.offset
