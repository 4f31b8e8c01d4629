"""A* to one goal; one wavefront for the cost to all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from occmap.barred import BarredGaps, Gap, gap_at
from occmap.body import Body
from occmap.boundary import Boundary
from occmap.config_checks import NeverNegative
from occmap.escape import way_out
from occmap.geometry import Pose2
from occmap.grid import Belief, Cells, OccupancyGrid
from occmap.path import Path
from occmap.search import SearchMemory, SearchRequest
from occmap.slices import Sliced
from occmap.terrain import FLOAT32_SLACK_M, ClearanceLimits, Terrain, escape_price_list, price_list
from occmap.wavefront import Wavefront

__all__ = ["Path", "Planner", "PlannerConfig", "Wavefront", "WideningFlood"]

RING_M = 16.0
"""A flood goes so much farther at a time: in the middle of a large hall that is two million cells."""
GAP_AHEAD_M = 0.6
"""What holds the robot up is looked for so far ahead: in reach of the follower's look."""
GAP_ARM = 4
"""The direction of a path through a gap is that from so many half cells before it to as many behind."""
DEAREST = 100.0
"""Of weights: costs are int32, and a way through 20,000 cells of it must not overflow."""


@dataclass(frozen=True)
class PlannerConfig(NeverNegative):
    """How close to obstacles the robot plans."""

    comfortable_margin_m: float = 0.09
    """Air left beside the body wherever there is room for it."""
    keep_margin_m: float = 0.04
    """A path is void only where less than this is left: were it the margin it was planned with, noise would
    void paths all the time."""
    tight_margin_m: float = 0.05
    """A gap that leaves this much air on both sides in truth is passed even where walls are painted thick."""
    wall_blur_m: float = 0.025
    """By how much range noise thickens a wall beyond the cell that holds its surface."""
    roomy_margin_m: float = 0.40
    """From here on more distance to walls earns nothing."""
    wall_weight: float = 3.0
    """A metre at the comfortable margin costs as much as this many in the open."""
    tight_weight: float = 20.0
    """A metre through a gap narrower than comfortable costs as much as this many in the open."""
    escape_radius_m: float = 1.0
    """How far a robot that stands too close to an obstacle looks for a place to start from."""
    island_area_m2: float = 1.0
    """If no more than this is in reach, the robot may be on an island made by noise: look for a mainland."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.keep_margin_m < self.comfortable_margin_m < self.roomy_margin_m:
            raise ValueError(
                "need 0 <= keep_margin_m < comfortable_margin_m < roomy_margin_m, got "
                f"{self.keep_margin_m}, {self.comfortable_margin_m} and {self.roomy_margin_m}"
            )
        if not 1.0 <= self.wall_weight <= self.tight_weight <= DEAREST:
            raise ValueError(
                f"need 1 <= wall_weight <= tight_weight <= {DEAREST:g}, "
                f"got {self.wall_weight}, {self.tight_weight}"
            )

    def limits(self, body_radius_m: float, resolution_m: float) -> ClearanceLimits:
        """These margins as clearances of a body's axis on a grid.

        A gap 2 * (body + tight_margin) wide may lose on either side the cell that its wall's surface
        enters and the blur; its middle may lie half a cell from the nearest cell's centre. What is
        left is the tight limit. It may be less than the body's radius: the follower, who sees the
        gap itself and not its cells, decides whether the body fits.
        """
        tight = body_radius_m + self.tight_margin_m - self.wall_blur_m - 1.5 * resolution_m
        tight = max(tight, 0.25 * resolution_m)  # the cell beside an occupied one stays open on coarse grids
        comfortable = body_radius_m + self.comfortable_margin_m
        return ClearanceLimits(
            comfortable_m=comfortable,
            comfortable_keep_m=body_radius_m + self.keep_margin_m,
            tight_m=min(tight, comfortable),
            tight_keep_m=max(tight - 0.5 * resolution_m, 0.0),
        )


class Planner:
    """Finds ways over the belief. Remembers its search arrays, price lists, and gaps found to be barred.

    Every method takes the grid and its clearance (ny, nx): metres from each cell's centre to the
    nearest occupied cell.
    """

    def __init__(
        self,
        config: PlannerConfig | None = None,
        body: Body | None = None,
        boundary: Boundary | None = None,
    ) -> None:
        self.config = config or PlannerConfig()
        self.body = body or Body()
        self.barred = BarredGaps()
        self._boundary = boundary
        self._memory = SearchMemory()
        self._resolution_m = math.nan

    def traversable(
        self, grid: OccupancyGrid, clearance_m: NDArray[np.float32], margin_m: float | None = None
    ) -> NDArray[np.bool_]:
        """(ny, nx) free cells with the body's radius and a margin (default: comfortable) of clearance."""
        margin = self.config.comfortable_margin_m if margin_m is None else margin_m
        return (grid.state == Belief.FREE) & (
            clearance_m >= np.float32(self.body.radius_m + margin - FLOAT32_SLACK_M)
        )

    def terrain(self, grid: OccupancyGrid, clearance_m: NDArray[np.float32]) -> Terrain:
        """The map as the searches see it."""
        resolution = grid.frame.resolution_m
        if resolution != self._resolution_m:
            c = self.config
            self._resolution_m = resolution
            self._limits = c.limits(self.body.radius_m, resolution)
            roomy = self.body.radius_m + c.roomy_margin_m
            self._prices = price_list(self._limits, roomy, c.wall_weight, c.tight_weight)
            self._escape_prices = escape_price_list()
        closed = self.barred.closed_cells(grid)
        if self._boundary is not None:
            closed = np.union1d(closed, self._boundary.closed_cells(grid))
        return Terrain.of(grid, clearance_m, self._prices, self._limits, closed)

    def flood(
        self,
        grid: OccupancyGrid,
        clearance_m: NDArray[np.float32],
        start_cell: tuple[int, int],
        *,
        within_m: float = math.inf,
    ) -> Wavefront:
        """Costs from a cell (ix, iy) to all cells in reach that cost at most within_m (Dijkstra 1959).

        ValueError if the cell lies outside the grid, or the clearance is not the grid's.
        """
        terrain = self.terrain(grid, clearance_m)
        return self._wave(terrain, start_cell, SearchRequest.flood(terrain, None, None, within_m))

    def widen(self, wave: Wavefront, within_m: float) -> Wavefront:
        """Go on with a bounded flood up to a wider bound, while the map is what it was: costs what is new.

        The narrower wave is void then. ValueError if it was not the planner's last search.
        """
        wave.check()
        if wave.is_exhausted:
            return wave
        terrain = wave.terrain
        request = SearchRequest.flood(terrain, None, None, within_m)
        exact_below = self._memory.widen(terrain, terrain.flat(wave.start_cell), terrain.prices, request)
        return replace(wave, exact_below=exact_below, search_number=self._memory.search_number)

    def plan(
        self,
        grid: OccupancyGrid,
        clearance_m: NDArray[np.float32],
        start_cell: tuple[int, int],
        goals: Cells,
    ) -> Path | None:
        """The cheapest path from a cell (ix, iy) to the nearest of the goals (n, 2), by A*; None if none is
        in reach. ValueError if the start lies outside the grid.
        """
        terrain = self.terrain(grid, clearance_m)
        goals = np.atleast_2d(np.asarray(goals, np.int64))
        wave = self._wave(terrain, start_cell, SearchRequest.towards(terrain, goals))
        costs = wave.cost_at(goals)
        best = int(np.argmin(costs))
        return wave.path_to((int(goals[best, 0]), int(goals[best, 1])))

    def is_blocked(
        self, path: Path, grid: OccupancyGrid, clearance_m: NDArray[np.float32], from_m: float = 0.0
    ) -> bool:
        """Whether the map has come to void what is left of a path, from_m along it."""
        terrain = self.terrain(grid, clearance_m)
        least_m = terrain.least_clearance(path.waypoints_in_map, max(from_m, path.escape_m))
        return least_m < path.keep_clear_m

    def gap_ahead(
        self, path: Path, grid: OccupancyGrid, clearance_m: NDArray[np.float32], from_m: float
    ) -> Gap | None:
        """The narrowest place on the next GAP_AHEAD_M of a path, if it is less than comfortable."""
        terrain = self.terrain(grid, clearance_m)
        along_m = from_m + np.arange(0.0, GAP_AHEAD_M, 0.5 * grid.frame.resolution_m)
        x, y = (np.interp(along_m, path.stations_m, path.waypoints_in_map[:, axis]) for axis in (0, 1))
        ix, iy = grid.frame.cell_from_map(np.column_stack((x, y))).T
        room_m = clearance_m[iy, ix]
        k = int(np.argmin(room_m))
        if not room_m[k] < terrain.limits.comfortable_m:
            return None
        before, after = max(k - GAP_ARM, 0), min(k + GAP_ARM, len(x) - 1)
        direction_rad = math.atan2(y[after] - y[before], x[after] - x[before])
        return gap_at((float(x[k]), float(y[k])), direction_rad, float(room_m[k]), grid)

    def release(self) -> None:
        """Give up the search arrays, as large as a map or two; the next search makes them again."""
        self._memory = SearchMemory()

    def _way_out(self, terrain: Terrain, start_cell: tuple[int, int]) -> NDArray[np.int32] | None:
        return way_out(self._memory, terrain, start_cell, self._escape_prices, self.config.escape_radius_m)

    def _wave(self, terrain: Terrain, start_cell: tuple[int, int], request: SearchRequest) -> Wavefront:
        """One search; if it gets nowhere from here, another from where the body can move on."""
        start, escape_cells = terrain.flat(start_cell), np.empty(0, np.int32)
        exact_below = self._memory.search(terrain, start, terrain.prices, request)
        if self._memory.n_touched * terrain.frame.resolution_m**2 <= self.config.island_area_m2:
            found = self._way_out(terrain, start_cell)
            if found is not None:
                start, escape_cells = int(found[-1]), found
            exact_below = self._memory.search(terrain, start, terrain.prices, request)
        return Wavefront(
            start_cell=terrain.cell(start),
            terrain=terrain,
            escape_cells=escape_cells,
            escape_radius_m=self.config.escape_radius_m,
            exact_below=exact_below,
            memory=self._memory,
            search_number=self._memory.search_number,
        )


class WideningFlood:
    """One flood from where the robot stands, asked for within wider and wider bounds on the cost.

    It goes on where it was, so that looking farther costs only what is farther. Ask for nothing else of
    the planner meanwhile, and leave the map as it is.
    """

    def __init__(self, planner: Planner, grid: OccupancyGrid, clearance_m: NDArray[np.float32], here: Pose2):
        self._planner = planner
        self._map = grid, clearance_m
        self._start_cell = grid.frame.cell_at(*here.position)
        self._wave: Wavefront | None = None
        self._bound_m = 0.0

    def __call__(self, within_m: float) -> Sliced[Wavefront]:
        """Flood all that costs at most so many metres, ring by ring; the wave before it is void."""
        while self._wave is None or (self._bound_m < within_m and not self._wave.is_exhausted):
            before = 0 if self._wave is None else self._wave.n_reached
            self._bound_m = min(within_m, self._bound_m + RING_M)
            self._wave = self._widened(self._bound_m)
            yield self._wave.n_reached - before
        return self._wave

    def _widened(self, within_m: float) -> Wavefront:
        if self._wave is None:
            return self._planner.flood(*self._map, self._start_cell, within_m=within_m)
        return self._planner.widen(self._wave, within_m)
