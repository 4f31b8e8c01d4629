"""Gaps that looked passable on the map and were not: closed to planning, so that ways lead elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2
from occmap.grid import OccupancyGrid, flat_inside
from occmap.memory import has_changed_around, known_around

SAME_GAP_M = 0.15
"""Places where the robot was held up that are nearer to each other are one gap."""
TRIES = 2
"""A gap is closed once it has held the robot up so often,"""
TRIES_WHERE_PASSED = 12
"""or so often where the robot has come through it."""
BEYOND_M = 0.1
"""So much farther than the clearance reaches the bar across a gap: into the walls."""


@dataclass(frozen=True, slots=True)
class Gap:
    """A narrow place on a path that the robot did not get through."""

    in_map: tuple[float, float]
    direction_rad: float  # of the path through it
    half_width_m: float
    known_cells: int  # around it, when it held the robot up
    tries: int = 1
    is_closed: bool = False
    was_reopened: bool = False

    def carried(self, new_map_from_old_map: Pose2) -> Gap:
        """The same gap after a correction of the map."""
        x, y = new_map_from_old_map.apply(np.array([self.in_map]))[0]
        turned = self.direction_rad + new_map_from_old_map.yaw_rad
        return replace(self, in_map=(float(x), float(y)), direction_rad=turned)

    def bar(self, spacing_m: float) -> Points:
        """(n, 2) places across the gap, in two rows: a line on the grid that no step crosses."""
        reach = self.half_width_m + BEYOND_M
        across = np.arange(-reach, reach + spacing_m, spacing_m)
        along = np.array([-0.5, 0.5]) * spacing_m
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        u, v = (values.ravel() for values in np.meshgrid(along, across))
        return np.column_stack((self.in_map[0] + c * u - s * v, self.in_map[1] + s * u + c * v))


class BarredGaps:
    """Which gaps have held the robot up; forgotten where the map around them has changed since."""

    def __init__(self) -> None:
        self._gaps: list[Gap] = []

    def note(self, gap: Gap, most_tries: int = TRIES) -> bool:
        """Take in that a gap held the robot up; False if it was closed by then, and is not to blame."""
        for k, known in enumerate(self._gaps):
            if math.dist(known.in_map, gap.in_map) < SAME_GAP_M:
                if known.is_closed:
                    return False
                tries = known.tries + 1
                self._gaps[k] = replace(
                    gap, tries=tries, is_closed=tries >= most_tries, was_reopened=known.was_reopened
                )
                return True
        self._gaps.append(gap)
        return True

    def reopen(self) -> bool:
        """Give each closed gap another chance, as many tries as before; False if all have had theirs."""
        anew = [gap.is_closed and not gap.was_reopened for gap in self._gaps]
        self._gaps = [
            replace(gap, tries=0, is_closed=False, was_reopened=True) if is_due else gap
            for gap, is_due in zip(self._gaps, anew, strict=True)
        ]
        return any(anew)

    def closed_cells(self, grid: OccupancyGrid) -> NDArray[np.int32]:
        """(n,) flat indices of cells that are not to be entered. O(gaps)."""
        self._gaps = [gap for gap in self._gaps if not has_changed_around(gap.in_map, gap.known_cells, grid)]
        bars = [gap.bar(0.5 * grid.frame.resolution_m) for gap in self._gaps if gap.is_closed]
        if not bars:
            return np.empty(0, np.int32)
        return flat_inside(grid.frame.cell_from_map(np.concatenate(bars)), grid.shape).astype(np.int32)

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._gaps = [gap.carried(new_map_from_old_map) for gap in self._gaps]


def gap_at(place: tuple[float, float], direction_rad: float, half_width_m: float, grid: OccupancyGrid) -> Gap:
    """A gap that has just held the robot up."""
    return Gap(place, direction_rad, half_width_m, known_around(place, grid))
