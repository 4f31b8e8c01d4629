"""Frontiers without a place to look into them from, as the map stands: of late, and of all of a building."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier
from occmap.grid import OccupancyGrid
from occmap.memory import has_changed_around, known_around

TRUSTED_RUNS = 20
"""So many searches rely on a look at all of a building before all is looked at again."""


class Hopeless:
    """Remembers hopeless frontiers until something touches them, or the map around them has changed.

    A tour through such frontiers would order what can be seen by what cannot.
    """

    def __init__(self) -> None:
        self._noted: dict[int, tuple[Frontier, int]] = {}  # by id; kept, so that the ids stay theirs

    def note(self, frontier: Frontier, grid: OccupancyGrid) -> None:
        """Take in that there is no viewpoint for a frontier."""
        self._noted[id(frontier)] = frontier, known_around(frontier.centroid_in_map, grid)

    def among(self, frontiers: Iterable[Frontier], grid: OccupancyGrid) -> set[int]:
        """The ids of those that are still hopeless; the others are forgotten. O(frontiers)."""
        self._noted = {
            id(frontier): self._noted[id(frontier)] for frontier in frontiers if self._is(frontier, grid)
        }
        return set(self._noted)

    def _is(self, frontier: Frontier, grid: OccupancyGrid) -> bool:
        noted = self._noted.get(id(frontier))
        return noted is not None and not has_changed_around(frontier.centroid_in_map, noted[1], grid)


@dataclass
class Leftovers:
    """What a look at all of a large building has left: frontiers without any goal, and edges that may be the
    mouths of nooks.
    """

    hopeless: dict[int, Frontier]  # by their ids, and kept, so that these stay theirs
    edges: list[Frontier]
    state: NDArray[np.uint8]  # the array they are cells of
    trust: int = TRUSTED_RUNS
