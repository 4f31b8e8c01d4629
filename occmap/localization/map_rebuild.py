"""After a correction: the grid again, from the corrected poses, where they moved, a few scans a turn."""

from __future__ import annotations

import numpy as np

from occmap.geometry import Pose2, wrap_angle
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.lazy_arrays import copy_written, fill_written
from occmap.localization.box import Box
from occmap.localization.mapped_scans import MappedScans
from occmap.mapper import Mapper

LARGE_CELLS = 4_000_000
"""To make a grid of more cells than this anew takes tens of milliseconds."""


class MapRebuild:
    """A new grid of every scan that meets a box, at the corrected poses; the list of scans may grow."""

    def __init__(
        self,
        scans: MappedScans,
        map_from_submap: list[Pose2],
        box: Box,
        mapper: Mapper,
        config: GridConfig,
    ) -> None:
        self.scans, self.map_from_submap, self.box = scans, map_from_submap, box
        self.grid = OccupancyGrid(config)
        self._mapper = mapper
        self._next = 0
        self._surveyed = 0
        self.is_surveyed = False
        """Whether the room is known that the scans need, but for those added since."""
        self._room: Box | None = None

    def make_room(self, live: OccupancyGrid) -> None:
        """Grow to all of the box at once, which costs nothing while it is empty.

        And to all of the grid that it is built for, if that is large.
        """
        box = self.box
        if live.state.size > LARGE_CELLS:
            box = Box.over([box, extent(live)])
        self.grid.grow_to_contain((box.low_x, box.low_y), (box.high_x, box.high_y))

    def survey(self, scans: int, room_m: float = 0.0) -> None:
        """Look how much room so many scans more will need; once all are known, make it.

        Where that is much, with some around it: to grow later would take too long.
        """
        last = min(self._surveyed + scans, len(self.scans))
        some = (self.scans[k] for k in range(self._surveyed, last))
        boxes = [mapped.box(mapped.map_from_lidar(self.map_from_submap)) for mapped in some]
        if self._room is not None:
            boxes.append(self._room)
        if boxes:
            self._room = Box.over(boxes)
        self._surveyed = last
        self.is_surveyed = last == len(self.scans)
        if self.is_surveyed and self._room is not None:
            is_large = self._room.area_m2 > LARGE_CELLS * self.grid.config.resolution_m**2
            room = Box.over([self._room], room_m if is_large else 0.0)
            self.grid.grow_to_contain((room.low_x, room.low_y), (room.high_x, room.high_y))

    def step(self, scans: int, effort_m: float) -> bool:
        """Spend so many scans more, up to an effort; fewer if the grid must grow. True once all are in."""
        last = min(self._next + scans, len(self.scans))
        shape = self.grid.shape
        while self._next < last and effort_m > 0.0:
            mapped = self.scans[self._next]
            map_from_lidar = mapped.map_from_lidar(self.map_from_submap)
            if self.box.meets(Box.around(*map_from_lidar.position, mapped.reach_m)):
                self._mapper.insert(mapped.scan, map_from_lidar, self.grid)
                effort_m -= mapped.effort_m
            self._next += 1
            if self.grid.shape != shape and shape != (0, 0):
                break  # growing copies all of it: enough for one turn
        return self._next == len(self.scans)

    def joined_with(self, live: OccupancyGrid) -> OccupancyGrid:
        """Grid of what was built within the box and what another knows around: one of the two, changed.

        A large one that would have to grow is not: its memory made anew would hold up the robot.
        """
        known = self._known()
        is_large = live.state.size > LARGE_CELLS and has_room_for(self.grid, extent(live))
        if known is not None and is_large and not has_room_for(live, known):
            self._take_around(live)
            return self.grid
        self._paste_on(live, known)
        return live

    def _paste_on(self, live: OccupancyGrid, known: Box | None) -> None:
        """Replace the box in a grid by what was built anew. In place: a copy of a campus takes too long."""
        if known is not None:
            live.grow_to_contain((known.low_x, known.low_y), (known.high_x, known.high_y))
        copy_cells(self.grid, live, *self._cells(live))

    def _take_around(self, live: OccupancyGrid) -> None:
        """Replace all but the box by what a grid knows."""
        (ny, nx), (rows, columns) = self.grid.shape, self._cells(self.grid)
        copy_cells(live, self.grid, slice(0, rows.start), slice(0, nx))
        copy_cells(live, self.grid, slice(rows.stop, ny), slice(0, nx))
        copy_cells(live, self.grid, rows, slice(0, columns.start))
        copy_cells(live, self.grid, rows, slice(columns.stop, nx))

    def _known(self) -> Box | None:
        """The centres of the cells in the box that anything is known of."""
        rows, columns = self._cells(self.grid)
        state = self.grid.state[rows, columns]  # a mask of all of it would cost more than to look
        y, x = np.flatnonzero(state.any(axis=1)), np.flatnonzero(state.any(axis=0))
        if len(y) == 0:
            return None
        low, high = (self.grid.frame.centre_of(columns.start + x[k], rows.start + y[k]) for k in (0, -1))
        return Box(*low, *high)

    def _cells(self, grid: OccupancyGrid) -> tuple[slice, slice]:
        """The box as rows and columns of a grid's arrays."""
        ny, nx = grid.shape
        low_x, low_y = grid.frame.cell_at(self.box.low_x, self.box.low_y)
        high_x, high_y = grid.frame.cell_at(self.box.high_x, self.box.high_y)
        return slice(min(max(low_y, 0), ny), min(max(high_y, 0), ny)), slice(
            min(max(low_x, 0), nx), min(max(high_x, 0), nx)
        )


def extent(grid: OccupancyGrid) -> Box:
    """Box from the centre of a grid's first cell to that of its last."""
    (ny, nx), frame = grid.shape, grid.frame
    return Box(*frame.centre_of(0, 0), *frame.centre_of(nx - 1, ny - 1))


def has_room_for(grid: OccupancyGrid, box: Box) -> bool:
    """Whether the cells at a box's corners are cells of a grid."""
    low, high = grid.frame.cell_at(box.low_x, box.low_y), grid.frame.cell_at(box.high_x, box.high_y)
    return grid.contains(*low) and grid.contains(*high)


def copy_cells(source: OccupancyGrid, target: OccupancyGrid, rows: slice, columns: slice) -> None:
    """Make some rows and columns of a grid what they are in another; unknown where that has no room."""
    (ny, nx), (dx, dy) = source.shape, (s - t for s, t in zip(source.offset, target.offset, strict=True))
    y0, x0 = min(max(rows.start, dy), rows.stop), min(max(columns.start, dx), columns.stop)
    y1, x1 = max(min(rows.stop, dy + ny), y0), max(min(columns.stop, dx + nx), x0)
    for layer, known, nothing in (
        (target.log_odds, source.log_odds, target.prior_log_odds),
        (target.state, source.state, Belief.UNKNOWN),
        (target.hits, source.hits, 0),
    ):
        around = (
            layer[rows.start : y0, columns],
            layer[y1 : rows.stop, columns],
            layer[y0:y1, columns.start : x0],
            layer[y0:y1, x1 : columns.stop],
        )
        for part in around:
            fill_written(part, nothing)
        copy_written(known[y0 - dy : y1 - dy, x0 - dx : x1 - dx], layer[y0:y1, x0:x1])


def displacement_m(before: Pose2, after: Pose2, lever_m: float) -> float:
    """How far a place has moved: its own shift, and its turn at the end of a lever."""
    return before.distance_to(after) + lever_m * abs(wrap_angle(after.yaw_rad - before.yaw_rad))
