"""The belief and the layers derived from it, kept in step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.boundary import Boundary
from occmap.clearance import ClearanceConfig, ClearanceMap, clearance_at, radius_cells
from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.mapper import GridChange, Mapper
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig
from occmap.stopwatch import Stopwatch
from occmap.worn_surfaces import worn_cells

ROOM_M = 1.0
"""So far round the robot the grid is made to reach where no beam has been."""
CELLS_PER_TURN = 1_000_000
"""So much of a grid is taken over into the layers in one turn: 15 to 30 ms, none may hold up the robot."""


class LivingMap:
    """A grid with its clearance and its frontiers: a scan changes all of them, and only where it must."""

    def __init__(
        self,
        grid: GridConfig,
        sensor_model: SensorModelConfig,
        clearance: ClearanceConfig,
        frontiers: FrontierConfig,
        boundary: Boundary | None = None,
    ) -> None:
        radius_cells(clearance.truncate_m, grid.resolution_m)  # too far is a mistake before the first scan
        self.grid = OccupancyGrid(grid)
        self.frontiers: list[Frontier] = []
        """As of the last `find_frontiers`; their cells are in the grid's current frame."""
        self.frontiers_beyond: list[Frontier] = []
        """The same, but beyond the boundary."""
        self._boundary = boundary
        self._known_cells = 0
        self._bands: list[slice] = []  # rows that the layers are still without
        self._mapper = Mapper(sensor_model)
        self._clearance = ClearanceMap(clearance)
        self._edges = FrontierMap(frontiers)

    @property
    def clearance_m(self) -> NDArray[np.float32]:
        """(ny, nx) distance to the nearest occupied cell."""
        return self._clearance.distance_m

    @property
    def frontier_mask(self) -> NDArray[np.uint8]:
        """(ny, nx) 1 in frontier cells."""
        return self._edges.mask

    def insert(self, scan: Scan, map_from_lidar: Pose2, watch: Stopwatch) -> None:
        """Spend a scan on the grid and take its changes over into the layers."""
        with watch.lap("mapping"):
            change = self._mapper.insert(scan, map_from_lidar, self.grid)
            self._known_cells += change.learnt_cells
            if change.grew:
                self._start_afresh(map_from_lidar)
            else:
                self._clearance.update(self.grid, change)
        if not change.grew:
            with watch.lap("frontiers"):
                self._edges.update(self.grid, change)

    def make_room(self, here: Pose2) -> None:
        """Let the grid reach to where the robot is: not every lidar looks over the robot's axis."""
        if not self.holds(here):
            (x_m, y_m), reach_m = here.position, ROOM_M
            self.grid.grow_to_contain((x_m - reach_m, y_m - reach_m), (x_m + reach_m, y_m + reach_m))
            self._start_afresh(here)

    def replace(self, grid: OccupancyGrid, here: Pose2) -> None:
        """Go on with another grid, as after a correction of the past; what is near is in order at once."""
        self.grid = grid
        self._known_cells = int(np.count_nonzero(grid.state))
        self._start_afresh(here)

    @property
    def is_settling(self) -> bool:
        """Whether clearance and frontiers are still without some rows of a large grid, far from the robot."""
        return bool(self._bands)

    def settle(self) -> None:
        """Take some more rows of the grid over into the layers: a turn's part of starting afresh."""
        if self._bands:
            band = self._bands.pop(0)
            self._clearance.take_rows(band, self.grid)
            self._edges.take_rows(band, self.grid)
            self.find_frontiers()

    def _start_afresh(self, here: Pose2) -> None:
        """The grid's arrays are others: the layers begin anew where the robot is, and grow from there."""
        self._clearance.clear(self.grid)
        self._edges.clear(self.grid)
        self._bands = bands_around(self.grid.frame.cell_at(*here.position)[1], self.grid.shape)
        self.settle()

    def restore_surfaces(self) -> None:
        """Believe in the walls that grazing beams have worn away: for a map that nobody adds to any more.

        While the robot drives, the next scan would wear them away again, and its layers flicker.
        """
        while self.is_settling:
            self.settle()
        grid = self.grid
        worn = worn_cells(grid.state, grid.hits)
        was = grid.state.ravel()[worn]
        grid.log_odds.ravel()[worn] = np.nextafter(grid.occupied_above, np.float32(np.inf))
        grid.state.ravel()[worn] = Belief.OCCUPIED
        change = GridChange(False, worn, was, grid.state)
        self._known_cells += change.learnt_cells
        self._clearance.update(grid, change)
        self._edges.update(grid, change)

    @property
    def known_m2(self) -> float:
        """Area of the cells that are free or occupied."""
        return float(self._known_cells) * self.grid.frame.resolution_m**2

    def holds(self, place: Pose2) -> bool:
        """Whether the grid reaches to where somebody is."""
        return self.grid.contains(*self.grid.frame.cell_at(*place.position))

    def clearance_at(self, place: Pose2) -> float:
        """Metres from a place to the nearest occupied cell, 0 outside of the map."""
        return clearance_at(place, self.grid, self.clearance_m)

    def find_frontiers(self) -> list[Frontier]:
        """The frontiers of this moment, within the boundary if there is one."""
        self.frontiers = self._edges.clusters(self.grid)
        if self._boundary is not None:
            self.frontiers, self.frontiers_beyond = self._boundary.split(self.frontiers, self.grid)
        return self.frontiers


def bands_around(row: int, shape: tuple[int, int]) -> list[slice]:
    """All rows of a grid in bands of CELLS_PER_TURN, those nearest to a row first."""
    ny, nx = shape
    height = max(1, CELLS_PER_TURN // max(nx, 1))
    if ny <= height:
        return [slice(0, ny)]
    first = min(max(row - height // 2, 0), ny - height)  # its row in the middle
    starts = [*range(first % height - height, ny, height)]
    bands = [slice(max(start, 0), min(start + height, ny)) for start in starts]
    bands = [band for band in bands if band.start < band.stop]
    return sorted(bands, key=lambda band: max(band.start - row, row - band.stop + 1, 0))
