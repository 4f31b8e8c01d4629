"""Spends scans on the grid: one Scan at one Pose2, and what that changed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2
from occmap.grid import SOLID_HITS, OccupancyGrid
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig

MAX_BEAMS = 65534
"""Votes are counted in 16 bits, and every beam crosses the sensor's own cell."""


@dataclass(frozen=True)
class GridChange:
    """The cells whose state one scan changed, in the grid's current frame.

    If `grew`, the arrays moved (or the grid is another one): whoever keeps a layer aligned with the
    grid starts afresh.
    """

    grew: bool
    flat_cells: NDArray[np.int32]  # (n,) indices into grid.state.ravel()
    was: NDArray[np.uint8]  # (n,) the state each had before
    state: NDArray[np.uint8]  # (ny, nx) the grid's state array, alive
    now_struck: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    """(m,) flat indices of the cells in which the first or the SOLID_HITS-th beam ended."""

    @property
    def learnt_cells(self) -> int:
        """Number of cells by which more is known than before."""
        was_known = np.count_nonzero(self.was)
        return int(np.count_nonzero(self.state.ravel()[self.flat_cells])) - int(was_known)


class Mapper:
    """Turns ranges into votes and votes into belief; keeps grid.state in step with grid.log_odds.

    Occupancy grid mapping with an inverse sensor model (Thrun et al. 2005, tables 9.1 and 9.2), but hits and
    misses weigh differently, and of one scan the misses are spent first: rays that graze a wall must not
    erase it. Its work space is kept: one mapper serves any number of grids, one scan at a time.
    """

    def __init__(self, config: SensorModelConfig | None = None) -> None:
        from occmap import beam_kernels, mapper_kernels  # compiled on first use, not on import

        self.config = config or SensorModelConfig()
        self._beam_kernels = beam_kernels
        self._kernels = mapper_kernels
        self._window = np.zeros(0, np.uint16)
        self._flips = np.empty(0, np.int32)
        self._was = np.empty(0, np.uint8)
        self._in_order: NDArray[np.float64] | None = None  # bearings that were found to ascend
        self._model_on: tuple[OccupancyGrid, Any] | None = None

    def insert(self, scan: Scan, map_from_lidar: Pose2, grid: OccupancyGrid) -> GridChange:
        """Spend one scan taken at this pose, and tell what that changed. O(cells crossed by its beams).

        The grid first grows to hold all of its beams (see OccupancyGrid.grow_to_contain). ValueError if the
        scan has more than MAX_BEAMS beams or free ones would be without end.
        """
        points, hit, low_m, high_m = self._beams_in_map(scan, map_from_lidar, grid.config.resolution_m)
        grew = grid.grow_to_contain(low_m, high_m)
        (ix0, iy0), (ix1, iy1) = grid.frame.cell_at(*low_m), grid.frame.cell_at(*high_m)
        word = self._kernels.VOTES_PER_WORD
        patch = self._kernels.Patch(ix0, iy0, rows=iy1 - iy0 + 1, stride=((ix1 - ix0) // word + 1) * word)
        self._make_room(patch.rows * patch.stride)
        in_window = grid.frame.in_cells(points) - (ix0, iy0)
        now_struck = self._beam_kernels.count_hits(in_window, hit, ix0, iy0, grid.hits, SOLID_HITS)
        n = self._integrate(patch, grid, in_window, hit)
        return GridChange(grew, self._flips[:n].copy(), self._was[:n].copy(), grid.state, now_struck)

    def _integrate(self, patch: Any, grid: OccupancyGrid, in_window: Points, hit: NDArray[np.bool_]) -> int:
        """Votes into belief, in one kernel call; returns how many changes are listed in _flips and _was."""
        model = self._model(grid)
        hits = np.empty((len(hit) * _most_hits(patch, model), 2), np.int64)
        kernels, is_cone = self._kernels, model.half_width > 0.0
        integrate = kernels.integrate_cones if is_cone else kernels.integrate_lines
        window = self._window, self._window.view(np.uint64)
        beliefs = grid.log_odds, grid.state
        return integrate(*window, patch, *beliefs, in_window, hit, model, hits, self._flips, self._was)

    def _beams_in_map(self, scan: Scan, map_from_lidar: Pose2, resolution_m: float):
        """Sensor and beam ends (1 + n, 2) in metres, which ends are hits (n,), and a box around all votes."""
        if len(scan.ranges_m) > MAX_BEAMS:
            raise ValueError(f"a scan may have at most {MAX_BEAMS} beams, got {len(scan.ranges_m)}")
        reach_m = min(scan.max_range_m, self.config.usable_range_m)
        if math.isinf(reach_m):
            raise ValueError(f"a beam that met nothing frees max_range_m: it must be finite, got {reach_m}")
        bearings_rad, ranges_m = self._beams_in_order(scan)
        points, hit, (low_x, low_y, high_x, high_y) = self._beam_kernels.beam_ends(
            bearings_rad,
            ranges_m,
            scan.least_range_m,
            scan.max_range_m,
            self.config.usable_range_m,
            self.config.no_returns_in_company,
            map_from_lidar.x_m,
            map_from_lidar.y_m,
            map_from_lidar.yaw_rad,
        )
        beyond_m = self.config.obstacle_thickness_m + resolution_m  # no rounding may leave the box
        beyond_m += (reach_m + beyond_m) * math.tan(self.config.beam_width_rad / 2.0)
        low_m, high_m = (low_x - beyond_m, low_y - beyond_m), (high_x + beyond_m, high_y + beyond_m)
        return points, hit, low_m, high_m

    def _beams_in_order(self, scan: Scan) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bearings, ascending, and ranges: neighbours must be neighbours."""
        bearings_rad, ranges_m = scan.bearings_rad, scan.ranges_m
        if bearings_rad is self._in_order:  # most lidars hand out the same bearings every time
            return bearings_rad, ranges_m
        if (bearings_rad[1:] < bearings_rad[:-1]).any():
            order = np.argsort(bearings_rad, kind="stable")
            return bearings_rad[order], ranges_m[order]
        self._in_order = bearings_rad
        return bearings_rad, ranges_m

    def _model(self, grid: OccupancyGrid) -> Any:
        if self._model_on is None or self._model_on[0] is not grid:
            self._model_on = grid, self._model_for(grid)
        return self._model_on[1]

    def _model_for(self, grid: OccupancyGrid) -> Any:
        hit, miss = self.config.increments(grid.config.prior)
        alpha = self.config.obstacle_thickness_m / grid.config.resolution_m
        is_cone = self.config.beam_width_rad > 0.0
        return self._kernels.Model(
            hit=np.float32(hit),
            miss=np.float32(miss),
            clamp=np.float32(grid.config.clamp),
            free_below=grid.free_below,
            occupied_above=grid.occupied_above,
            one_vote=self.config.one_vote_per_scan,
            alpha=max(alpha, 0.5) if is_cone else alpha,  # half a cell closes the gaps in a cone's arc
            half_width=self.config.beam_width_rad / 2.0,
        )

    def _make_room(self, cells: int) -> None:
        if len(self._window) < cells:
            self._window = np.zeros(cells, np.uint16)
            self._flips = np.empty(cells, np.int32)
            self._was = np.empty(cells, np.uint8)


def _most_hits(patch: Any, model: Any) -> int:
    """An upper bound on the cells that one beam hits: a band 2 alpha deep and as wide as the cone."""
    width = 2.0 * (patch.rows + patch.stride) * math.tan(model.half_width)
    return math.ceil(2.0 * model.alpha + 3.0) * math.ceil(width + 3.0 if width else 1.0)
