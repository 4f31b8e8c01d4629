"""What the localizer says late: corrected maps, mended scans, scans not worth the grid."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from occmap.decision import Status
from occmap.geometry import Pose2
from occmap.grid import Belief, OccupancyGrid
from occmap.localization.localizer import Estimate, OdometryLocalizer
from tests.occmap.explored_worlds import CELL, FLAT, TWO_ROOMS, Sleepy, exploring


class Correcting(OdometryLocalizer):
    """Believes the wheels, and when told to corrects the map: all of it moves by the same transform."""

    def __init__(self, shift):
        super().__init__()
        self.shift, self.map_from_odometry = shift, Pose2.identity()
        self.grid = None

    def correct(self, grid):
        """With the next scan."""
        self.grid, self.map_from_odometry = carried(grid, self.shift), self.shift

    def update(self, seen):
        here = self.map_from_odometry @ super().update(seen).map_from_robot
        grid, self.grid = self.grid, None
        return Estimate(here, grid=grid, map_shift=None if grid is None else self.shift)


def carried(old, shift):
    """A grid of its own with everything moved."""
    new = OccupancyGrid(old.config)
    ny, nx = old.shape
    corners = shift.apply(old.frame.map_from_cell(np.array([(0, 0), (nx, 0), (0, ny), (nx, ny)])))
    new.grow_to_contain(tuple(corners.min(axis=0)), tuple(corners.max(axis=0)))
    iy, ix = np.indices(new.shape)
    places = shift.inverse().apply(new.frame.map_from_cell(np.column_stack((ix.ravel(), iy.ravel()))))
    x, y = old.frame.cell_from_map(places).T
    inside = (x >= 0) & (y >= 0) & (x < nx) & (y < ny)
    new.state.ravel()[inside] = old.state[y[inside], x[inside]]
    new.log_odds.ravel()[inside] = old.log_odds[y[inside], x[inside]]
    return new


def test_over_a_correction_of_the_map_it_carries_on_with_its_goal():
    localizer = Correcting(shift := Pose2(0.8, -0.5, 0.4))
    flat = exploring(FLAT, localizer=localizer)
    flat.run(8.0)
    before = flat.run(60.0, until=lambda decision: any("frontier" in event for event in decision.events))
    localizer.correct(flat.explorer.grid)  # just after a goal was chosen
    after = flat.run(0.1)
    assert "the map was corrected" in after.events
    assert before.goal is not None
    assert after.goal is not None
    assert after.goal.distance_m(before.goal.carried(shift)) < 0.5
    assert after.goal_switches == before.goal_switches
    assert math.dist(after.path.waypoints_in_map[0], after.map_from_robot.position) < 0.2
    assert flat.run(300.0).status is Status.COMPLETE
    flat.map_from_world = shift @ flat.map_from_world
    assert flat.explored() > 0.99


def test_over_a_correction_what_was_lost_is_still_missed():
    localizer = Correcting(Pose2(-0.6, 0.3, 0.2))
    rooms = exploring(TWO_ROOMS, localizer=localizer)
    rooms.run(120.0, until=lambda _: rooms.world.pose.x_m > 11.8 * rooms.cell_m)
    rooms.close_doors()
    rooms.run(1.0)
    localizer.correct(rooms.explorer.grid)
    assert rooms.run(240.0).status is Status.SEALED_IN
    assert "the map was corrected" in rooms.events


def test_a_map_that_does_not_hold_the_robot_is_shown_where_it_is():
    cell = exploring(CELL, localizer=Sleepy(from_s=0.0))
    cell.run(1.0)
    assert cell.explorer.grid.contains(*cell.explorer.grid.frame.cell_at(0.0, 0.0))


def test_a_scan_mended_by_the_localizer_is_the_one_that_is_mapped():
    class Mending(OdometryLocalizer):
        def update(self, seen):
            nearer = replace(seen.scan, ranges_m=0.5 * seen.scan.ranges_m)
            return replace(super().update(seen), scan=nearer)

    cell = exploring(CELL, localizer=Mending())
    cell.run(0.4)
    grid = cell.explorer.grid
    iy, ix = np.nonzero(grid.state == Belief.OCCUPIED)
    away_m = np.hypot(*grid.frame.map_from_cell(np.column_stack((ix, iy))).T)
    assert away_m.max() < 1.3  # half of the room's half diagonal, 1.9 m
