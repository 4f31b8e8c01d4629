"""Nooks: slits and corners between obstacles. No frontier tells of them: their mouths are walls' rims."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from occmap.boundary import Boundary
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.goals import Goal, GoalChooser
from occmap.grid import OccupancyGrid
from occmap.memory import FailedLooks
from occmap.wavefront import Wavefront


class Nooks:
    """Finds them, and where to look into them from; not those that were looked into in vain."""

    def __init__(self, chooser: GoalChooser, looks: FailedLooks, boundary: Boundary | None) -> None:
        self._chooser = chooser
        self._looks = looks
        self._boundary = boundary

    def edges(self, grid: OccupancyGrid) -> list[Frontier]:
        """Every edge of the unknown long enough for a nook; the frontier map leaves walls' rims out."""
        every_edge = FrontierMap(FrontierConfig(ignore_rim=False))
        every_edge.rebuild(grid)
        edges = every_edge.clusters(grid, self._chooser.config.least_nook_m(grid.frame.resolution_m))
        return edges if self._boundary is None else self._boundary.split(edges, grid)[0]

    def goals(
        self, edges: Iterable[Frontier], grid: OccupancyGrid, wave: Wavefront, max_range_m: float
    ) -> Iterator[Goal]:
        """A look into each of those edges that is a nook, from within half the lidar's range."""
        for edge in edges:
            if not self._looks.at(edge, grid):
                goal = self._chooser.goal_into_nook(edge, grid, wave, 0.5 * max_range_m)
                if goal is not None:
                    yield goal
