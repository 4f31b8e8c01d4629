"""Nooks: slits and corners between obstacles. No frontier tells of them: their mouths are walls' rims."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from occmap.boundary import Boundary
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.goal_config import COARSE_M, SPECK_M
from occmap.goals import TARGETS, Goal, GoalChooser
from occmap.grid import OccupancyGrid
from occmap.living_map import bands_around
from occmap.looked_at import LookedAt
from occmap.lookouts import SEEN_SHARE
from occmap.memory import FailedLooks
from occmap.slices import Sliced
from occmap.views import LOOK_CELLS
from occmap.wavefront import Wavefront

DEPTH_M = 0.35
"""A nook is at least this deep."""
INTO_M = (1.0, 0.5)
"""It is looked into this deep, or at least this, for its bottom is what is not known."""
GAP_DEPTH_M = 0.5
"""What a gap as wide as the robot promises for each metre of its width: a corner is behind it, or a room."""
BESIDE_M = 0.5
"""A crack in a wall that the robot can come up to is no farther from where its axis can be."""
UNTOUCHED = 0.1
"""Log-odds nearer to the prior than this no beam has changed: less than any beam does."""


class Nooks:
    """Finds nooks, and where to look into them from; not those that were looked into in vain."""

    def __init__(
        self, chooser: GoalChooser, looks: FailedLooks, looked_at: LookedAt, boundary: Boundary | None
    ) -> None:
        from occmap import goals_kernels

        self._kernels = goals_kernels
        self._chooser = chooser
        self._looks = looks
        self._looked_at = looked_at
        self._boundary = boundary

    def edges(self, grid: OccupancyGrid) -> Sliced[list[Frontier]]:
        """Every edge of the unknown long enough for a nook; the frontier map leaves walls' rims out."""
        return self._edges(grid, self._least_m(grid))

    def slits(self, grid: OccupancyGrid, wave: Wavefront) -> Sliced[list[Frontier]]:
        """The mouths of nooks not looked into, and narrow ones that cracks look like."""
        edges = yield from self._edges(grid, 0.0)
        nooks = [goal.frontier for goal in (yield from self.goals(edges, grid, wave))]
        told = {id(mouth.cells) for mouth in nooks}
        others = [edge for edge in edges if id(edge.cells) not in told and _is_beside(edge, grid, wave)]
        return nooks + [edge for edge in others if self._is_crack(edge, grid)]

    def _edges(self, grid: OccupancyGrid, least_m: float) -> Sliced[list[Frontier]]:
        is_coarse = grid.frame.resolution_m >= COARSE_M  # walls graze the corners of many cells
        every_edge = FrontierMap(FrontierConfig(ignore_rim=False, ignore_struck=is_coarse))
        every_edge.clear(grid)
        for rows in bands_around(0, grid.shape):
            every_edge.take_rows(rows, grid)
            yield (rows.stop - rows.start) * grid.shape[1] // 3
        edges = every_edge.clusters(grid, least_m)
        return edges if self._boundary is None else self._boundary.split(edges, grid)[0]

    def goals(self, edges: Iterable[Frontier], grid: OccupancyGrid, wave: Wavefront) -> Sliced[list[Goal]]:
        """A look into each of those edges that is a nook, from within half the lidar's range, or a gap."""
        found: list[Goal] = []
        for edge in edges:
            if not self._looks.at(edge, grid):
                goal = self.goal_into(edge, grid, wave, 0.5 * self._chooser.sight_m)
                goal = goal or self._goal_into_gap(edge, grid, wave)
                if goal is not None:
                    found.append(goal)
                yield LOOK_CELLS + self._chooser.spent()
        return found

    def goal_into(self, mouth: Frontier, grid: OccupancyGrid, wave: Wavefront, from_m: float) -> Goal | None:
        """As deep a look into a nook as there is a place for, at most from_m before it.

        A nook is told from a wall's cells that flicker by its depth, by several lines that lead into it,
        and by no beam ever having got there.
        """
        r = grid.frame.resolution_m
        if mouth.size * r < self._least_m(grid):
            return None
        for into_m in INTO_M:
            deepest = max(1, round(into_m / r))
            least = max(1, round(max(0.5 * into_m, DEPTH_M) / r))
            untouched = self._untouched_inside(mouth, grid, least, deepest)
            if len(untouched) < TARGETS:
                continue
            sample = untouched[:: len(untouched) // TARGETS].copy()
            for share in (SEEN_SHARE, 0.0):
                goal = self._chooser.goal_seeing(sample, mouth, grid, wave, from_m + into_m, share=share)
                if goal is not None:
                    depth_cells = float(np.median(sample[:, 2]))
                    return replace(goal, is_nook=True, gain_m2=mouth.size * depth_cells * r * r)
        return None

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

    def _least_m(self, grid: OccupancyGrid) -> float:
        """Least length of an edge along walls that is the mouth of a nook."""
        return self._chooser.config.least_nook_m(grid.frame.resolution_m)

    def _is_crack(self, edge: Frontier, grid: OccupancyGrid) -> bool:
        """Whether an edge along walls, too narrow for the body, opens onto as deep a slit as nooks are."""
        r = grid.frame.resolution_m
        deep = max(1, round(DEPTH_M / r))
        return edge.size * r < SPECK_M and len(self._untouched_inside(edge, grid, deep, deep)) > 0

    def _untouched_inside(
        self, mouth: Frontier, grid: OccupancyGrid, least: int, deepest: int
    ) -> NDArray[np.int64]:
        """Targets (n, 5), see goals_kernels, so many steps behind a mouth that no beam has ever got to."""
        inside = self._kernels.unknown_inside(grid.state, mouth.cells, least, deepest)
        belief = grid.log_odds[inside[:, self._kernels.INSIDE_Y], inside[:, self._kernels.INSIDE_X]]
        return inside[np.abs(belief - grid.prior_log_odds) < UNTOUCHED]


def _is_beside(edge: Frontier, grid: OccupancyGrid, wave: Wavefront) -> bool:
    """Whether the body gets to within BESIDE_M of an edge: beyond glass there are cracks without number."""
    reach = round(BESIDE_M / grid.frame.resolution_m)
    (x0, y0), (x1, y1) = np.maximum(edge.cells.min(axis=0) - reach, 0), edge.cells.max(axis=0) + reach + 1
    cost, below = wave.raw_costs()
    return bool((cost[y0:y1, x0:x1] < below).any())
