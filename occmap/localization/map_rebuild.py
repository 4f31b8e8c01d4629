"""After a correction: the grid again, from the corrected poses, where they moved, a few scans a turn."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

from occmap.geometry import Pose2, wrap_angle
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.localization.tracker import Tracked
from occmap.mapper import Mapper
from occmap.scan import Scan


@dataclass(frozen=True)
class MappedScan:
    """A scan that is in the map, and where it was taken."""

    scan: Scan
    robot_from_lidar: Pose2
    tracked: Tracked
    reach_m: float
    """No vote of it lies farther from the lidar."""


@dataclass(frozen=True)
class Box:
    """A rectangle of the map, in metres."""

    low_x: float
    low_y: float
    high_x: float
    high_y: float

    @staticmethod
    def everywhere() -> Box:
        return Box(-math.inf, -math.inf, math.inf, math.inf)

    @staticmethod
    def around(x: float, y: float, reach_m: float) -> Box:
        return Box(x - reach_m, y - reach_m, x + reach_m, y + reach_m)

    @staticmethod
    def over(boxes: list[Box], room_m: float = 0.0) -> Box:
        """The least box that holds all of them, and some room around."""
        return Box(
            min(b.low_x for b in boxes) - room_m,
            min(b.low_y for b in boxes) - room_m,
            max(b.high_x for b in boxes) + room_m,
            max(b.high_y for b in boxes) + room_m,
        )

    def meets(self, other: Box) -> bool:
        return (
            self.low_x <= other.high_x
            and other.low_x <= self.high_x
            and self.low_y <= other.high_y
            and other.low_y <= self.high_y
        )

    def holds(self, other: Box) -> bool:
        return (
            self.low_x <= other.low_x
            and self.low_y <= other.low_y
            and other.high_x <= self.high_x
            and other.high_y <= self.high_y
        )


class MapRebuild:
    """A new grid of every scan that meets a box, at the corrected poses; the list of scans may grow."""

    def __init__(
        self,
        scans: list[MappedScan],
        map_from_submap: list[Pose2],
        box: Box,
        mapper: Mapper,
        config: GridConfig,
    ) -> None:
        self.scans, self.map_from_submap, self.box = scans, map_from_submap, box
        self.grid = OccupancyGrid(config)
        self._mapper = mapper
        self._next = 0

    def make_room(self, live: OccupancyGrid) -> None:
        """Grow at once to what of the box lies in a grid of nearly the same scans: it costs least now."""
        r, (ny, nx), (ox, oy) = live.config.resolution_m, live.shape, live.offset
        low = max(self.box.low_x, ox * r), max(self.box.low_y, oy * r)
        high = min(self.box.high_x, (ox + nx - 0.5) * r), min(self.box.high_y, (oy + ny - 0.5) * r)
        if low[0] < high[0] and low[1] < high[1]:
            self.grid.grow_to_contain(low, high)

    def step(self, scans: int) -> bool:
        """Spend so many scans more, fewer if the grid must grow for one; True once all are in."""
        last = min(self._next + scans, len(self.scans))
        shape = self.grid.shape
        while self._next < last:
            mapped = self.scans[self._next]
            map_from_lidar = mapped.tracked.in_map(self.map_from_submap) @ mapped.robot_from_lidar
            if self.box.meets(Box.around(*map_from_lidar.position, mapped.reach_m)):
                self._mapper.insert(mapped.scan, map_from_lidar, self.grid)
            self._next += 1
            if self.grid.shape != shape and shape != (0, 0):
                break  # growing copies all of it: enough for one turn
        return self._next == len(self.scans)

    def pasted_on(self, live: OccupancyGrid) -> OccupancyGrid:
        """A copy of a grid, in which the box is replaced by what was built anew."""
        whole = copy.copy(live)
        whole.log_odds, whole.state = live.log_odds.copy(), live.state.copy()
        whole.hits = live.hits.copy()
        r, (ny, nx), (ox, oy) = whole.config.resolution_m, self.grid.shape, self.grid.offset
        if nx:
            whole.grow_to_contain((ox * r, oy * r), ((ox + nx - 0.5) * r, (oy + ny - 0.5) * r))
        rows, columns = self._cells(whole)
        whole.log_odds[rows, columns] = whole.prior_log_odds
        whole.state[rows, columns] = Belief.UNKNOWN
        whole.hits[rows, columns] = 0
        dx, dy = ox - whole.offset[0], oy - whole.offset[1]
        rows = slice(max(rows.start, dy), max(min(rows.stop, dy + ny), dy))
        columns = slice(max(columns.start, dx), max(min(columns.stop, dx + nx), dx))
        source = slice(rows.start - dy, rows.stop - dy), slice(columns.start - dx, columns.stop - dx)
        whole.log_odds[rows, columns] = self.grid.log_odds[source]
        whole.state[rows, columns] = self.grid.state[source]
        whole.hits[rows, columns] = self.grid.hits[source]
        return whole

    def _cells(self, grid: OccupancyGrid) -> tuple[slice, slice]:
        """The box as rows and columns of a grid's arrays."""
        ny, nx = grid.shape
        low_x, low_y = grid.frame.cell_at(self.box.low_x, self.box.low_y)
        high_x, high_y = grid.frame.cell_at(self.box.high_x, self.box.high_y)
        return slice(min(max(low_y, 0), ny), min(max(high_y, 0), ny)), slice(
            min(max(low_x, 0), nx), min(max(high_x, 0), nx)
        )


def displacement_m(before: Pose2, after: Pose2, lever_m: float) -> float:
    """How far a place has moved: its own shift, and its turn at the end of a lever."""
    return before.distance_to(after) + lever_m * abs(wrap_angle(after.yaw_rad - before.yaw_rad))
