"""Places that have been looked into: what is left there, or comes back with the noise, is a leftover."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from occmap.frontiers import Frontier
from occmap.geometry import Pose2
from occmap.goals import Goal
from occmap.grid import OccupancyGrid
from occmap.memory import are_joined, has_changed_around, known_around, middle

SAME_LOOK_M = 1.0
"""A look shows what is around its frontier: what it leaves, and what noise opens later, lies so near."""
SHOWN_M2 = 0.2
"""A look from far away that makes less of its frontier's surroundings known was in vain."""


@dataclass(frozen=True, slots=True)
class Look:
    """A frontier, or a nook, that was looked into."""

    in_map: tuple[float, float]  # the middle of the frontier, on it
    known_cells: int  # around it afterwards
    is_nook: bool


class LookedAt:
    """Remembers looks that were had, until the map around them changes; and what far ones showed of late.

    On maps of real buildings the last edges of the unknown are cells that most beams miss: seen from one
    place, undecided again from the next. Who drives to each of them whenever it is there drives for ever.
    """

    def __init__(self) -> None:
        self._looks: list[Look] = []
        self._trip: tuple[Goal, int] | None = None  # a far goal, and what was known around it on setting out
        self.in_vain = 0
        """So many looks from far away in a row have shown next to nothing."""

    def set_out(self, goal: Goal, grid: OccupancyGrid, *, is_far: bool) -> None:
        """Take in that the robot drives to another goal."""
        known_cells = known_around(goal.frontier.centroid_in_map, grid)
        self._trip = (goal, known_cells) if is_far else None

    def note(self, goal: Goal, grid: OccupancyGrid) -> None:
        """Take in that a goal has been looked into, or that its frontier was gone before the robot came."""
        if self._trip is not None:
            far_goal, known_cells = self._trip
            shown_cells = known_around(far_goal.frontier.centroid_in_map, grid) - known_cells
            is_in_vain = shown_cells * grid.frame.resolution_m**2 < SHOWN_M2
            self.in_vain, self._trip = (self.in_vain + 1 if is_in_vain else 0), None
        for watched in (goal.watched_in_map, *goal.also_watched_in_map):
            place = middle(watched)
            self._looks.append(Look(place, known_around(place, grid), goal.is_nook))

    def times(self, frontier: Frontier, grid: OccupancyGrid, *, is_nook: bool = False) -> int:
        """How many looks were had where a frontier lies; of a nook, looks into nooks. O(looks)."""
        reach_m = SAME_LOOK_M + frontier.size * grid.frame.resolution_m
        near = [
            look
            for look in self._looks
            if look.is_nook == is_nook and math.dist(look.in_map, frontier.centroid_in_map) < reach_m
        ]
        if not near:
            return 0
        place = middle(grid.frame.map_from_cell(frontier.cells))
        return sum(
            math.dist(look.in_map, place) < SAME_LOOK_M
            and are_joined(look.in_map, place, grid)
            and not has_changed_around(look.in_map, look.known_cells, grid)
            for look in near
        )

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._looks = [
            replace(look, in_map=middle(new_map_from_old_map.apply(np.array([look.in_map]))))
            for look in self._looks
        ]
        self._trip = None
