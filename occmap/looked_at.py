"""Places that have been looked into: what is left there, or comes back with the noise, is a leftover."""

from __future__ import annotations

from dataclasses import dataclass

from occmap.frontiers import Frontier
from occmap.geometry import Pose2
from occmap.goals import Goal
from occmap.grid import OccupancyGrid
from occmap.memory import Look, carried, known_around, look_fields, still_there

SAME_LOOK_M = 1.0
"""A look shows what is around its frontier: what it leaves, and what noise opens later, lies so near."""
SHOWN_M2 = 0.2
"""A look from far away that makes less of its frontier's surroundings known was in vain."""


@dataclass(frozen=True, slots=True)
class CompletedLook(Look):
    """A look that was had, in vain or not."""

    is_nook: bool


class LookedAt:
    """Remembers looks that were had, until the map around them changes; and what far ones showed of late.

    On maps of real buildings the last edges of the unknown are cells that most beams miss: seen from one
    place, undecided again from the next. A robot that drives to each of them whenever it appears never
    ends.
    """

    def __init__(self) -> None:
        self._looks: list[CompletedLook] = []
        self._trip: tuple[Goal, int] | None = None  # a far goal, and what was known around it on setting out
        self.in_vain = 0
        """So many looks from far away in a row have shown next to nothing."""

    def set_out(self, goal: Goal, grid: OccupancyGrid, *, is_far: bool) -> None:
        """Take in that the robot drives to another goal."""
        self._trip = (goal, known_around(goal.frontier.centroid_in_map, grid)) if is_far else None

    def note(self, goal: Goal, grid: OccupancyGrid) -> None:
        """Take in that a goal has been looked into, or that its frontier was gone before the robot came."""
        if self._trip is not None:
            far_goal, known_cells = self._trip
            shown_cells = known_around(far_goal.frontier.centroid_in_map, grid) - known_cells
            is_in_vain = shown_cells * grid.frame.resolution_m**2 < SHOWN_M2
            self.in_vain, self._trip = (self.in_vain + 1 if is_in_vain else 0), None
        for watched in (goal.watched_in_map, *goal.also_watched_in_map):
            self._looks.append(CompletedLook(*look_fields(watched, grid), goal.is_nook))

    def times(self, frontier: Frontier, grid: OccupancyGrid, *, is_nook: bool = False) -> int:
        """How many looks were had where a frontier lies; of a nook, looks into nooks. O(looks)."""
        alike = [look for look in self._looks if look.is_nook == is_nook]
        return len(still_there(alike, frontier, SAME_LOOK_M, grid))

    def carry_over(self, new_map_from_old_map: Pose2) -> None:
        """Follow a correction of the map."""
        self._looks = carried(self._looks, new_map_from_old_map)
        self._trip = None
