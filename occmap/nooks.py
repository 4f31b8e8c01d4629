"""Nooks: slits and corners between obstacles. No frontier tells of them: their mouths are walls' rims."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from occmap.boundary import Boundary
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.goal_config import COARSE_M, SPECK_M
from occmap.goals import Goal, GoalChooser
from occmap.grid import OccupancyGrid
from occmap.living_map import bands_around
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.slices import Sliced
from occmap.views import FAR_CELLS
from occmap.wavefront import Wavefront

GAP_DEPTH_M = 0.5
"""What a gap as wide as the robot promises for each metre of its width: a corner is behind it, or a room."""
BESIDE_M = 0.5
"""A crack in a wall that the robot can come up to is no farther from where its axis can be."""


class Nooks:
    """Finds them, and where to look into them from; not those that were looked into in vain."""

    def __init__(
        self, chooser: GoalChooser, looks: FailedLooks, looked_at: LookedAt, boundary: Boundary | None
    ) -> None:
        self._chooser = chooser
        self._looks = looks
        self._looked_at = looked_at
        self._boundary = boundary

    def edges(self, grid: OccupancyGrid) -> Sliced[list[Frontier]]:
        """Every edge of the unknown long enough for a nook; the frontier map leaves walls' rims out."""
        return self._edges(grid, self._chooser.config.least_nook_m(grid.frame.resolution_m))

    def slits(self, grid: OccupancyGrid, wave: Wavefront, max_range_m: float) -> Sliced[list[Frontier]]:
        """The mouths of nooks not looked into, and narrow ones that cracks look like."""
        edges = yield from self._edges(grid, 0.0)
        nooks = [goal.frontier for goal in (yield from self.goals(edges, grid, wave, max_range_m))]
        told = {id(mouth.cells) for mouth in nooks}
        others = [edge for edge in edges if id(edge.cells) not in told and _is_beside(edge, grid, wave)]
        return nooks + [edge for edge in others if self._chooser.is_crack(edge, grid)]

    def _edges(self, grid: OccupancyGrid, least_m: float) -> Sliced[list[Frontier]]:
        is_coarse = grid.frame.resolution_m >= COARSE_M  # walls graze the corners of many cells
        every_edge = FrontierMap(FrontierConfig(ignore_rim=False, ignore_struck=is_coarse))
        every_edge.clear(grid)
        for rows in bands_around(0, grid.shape):
            every_edge.take_rows(rows, grid)
            yield (rows.stop - rows.start) * grid.shape[1] // 3
        edges = every_edge.clusters(grid, least_m)
        return edges if self._boundary is None else self._boundary.split(edges, grid)[0]

    def goals(
        self, edges: Iterable[Frontier], grid: OccupancyGrid, wave: Wavefront, max_range_m: float
    ) -> Sliced[list[Goal]]:
        """A look into each of those edges that is a nook, from within half the lidar's range, or a gap."""
        found: list[Goal] = []
        for edge in edges:
            if not self._looks.at(edge, grid):
                goal = self._chooser.goal_into_nook(edge, grid, wave, 0.5 * max_range_m)
                goal = goal or self._goal_into_gap(edge, grid, wave)
                if goal is not None:
                    found.append(goal)
                yield FAR_CELLS // 2
        return found

    def _goal_into_gap(self, edge: Frontier, grid: OccupancyGrid, wave: Wavefront) -> Goal | None:
        """One look, from near, into an edge as wide as the robot, though beams have been in there.

        Clutter that shows through a gap breaks it up into specks of frontier, and a room may be behind it.
        """
        config, width_m = self._chooser.config, edge.size * grid.frame.resolution_m
        if width_m < SPECK_M or self._looked_at.times(edge, grid, is_nook=True):
            return None
        from_m, into_m = config.look_from_m[0], config.look_into_m[0]
        goal = self._chooser.goal_for(edge, grid, wave, from_m, into_m, stride=1, share=0.0)
        return None if goal is None else replace(goal, is_nook=True, gain_m2=width_m * GAP_DEPTH_M)


def _is_beside(edge: Frontier, grid: OccupancyGrid, wave: Wavefront) -> bool:
    """Whether the body gets to within BESIDE_M of an edge: beyond glass there are cracks without number."""
    reach = round(BESIDE_M / grid.frame.resolution_m)
    (x0, y0), (x1, y1) = np.maximum(edge.cells.min(axis=0) - reach, 0), edge.cells.max(axis=0) + reach + 1
    cost, below = wave.fixed_point()
    return bool((cost[y0:y1, x0:x1] < below).any())
