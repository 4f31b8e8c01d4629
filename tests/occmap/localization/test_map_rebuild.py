"""A grid is built anew in slices that cost about the same, wherever the robot was."""

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization.box import Box
from occmap.localization.map_rebuild import MapRebuild
from occmap.localization.mapped_scans import MappedScan, MappedScans
from occmap.localization.tracked import Tracked
from occmap.mapper import Mapper
from occmap.scan import Scan


def mapped(range_m: float, beams: int = 90) -> MappedScan:
    bearings = np.linspace(-math.pi, math.pi, beams, endpoint=False)
    here = Tracked(0, Pose2.identity(), Pose2.identity(), 0.0)
    return MappedScan.of(Scan(bearings, np.full(beams, range_m), 100.0), Pose2.identity(), here)


def kept(*scans: MappedScan) -> MappedScans:
    packed = MappedScans()
    for each in scans:
        packed.append(each)
    return packed


def scans_a_turn(range_m: float, effort_m: float = 20_000.0) -> int:
    scans = kept(*[mapped(range_m)] * 100)
    rebuild = MapRebuild(scans, [Pose2.identity()], Box.everywhere(), Mapper(), GridConfig(0.2))
    rebuild.survey(len(scans))
    turns = 1
    while not rebuild.step(100, effort_m):
        turns += 1
    return round(100 / turns)


def test_a_scan_costs_the_length_of_its_beams_and_the_window_around_them():
    near, far = mapped(2.0), mapped(40.0)
    assert near.effort_m == pytest.approx(90 * 2.0 + 2.0 * 4.0**2, rel=0.01)
    assert far.effort_m == pytest.approx(90 * 40.0 + 2.0 * 80.0**2, rel=0.01)


def test_fewer_scans_that_reach_far_are_mapped_in_a_turn_than_their_beams_alone_would_allow():
    assert scans_a_turn(2.0) >= 30
    assert scans_a_turn(40.0) == 2  # their beams alone: 6


@pytest.mark.parametrize("start_x_m", [0.0, 30.0])
def test_a_box_built_anew_replaces_the_same_box_in_a_grid_that_grows_only_to_what_is_known(start_x_m: float):
    """It is built in room made beforehand, so that nothing has to move while it grows."""
    scans, poses = kept(mapped(3.0)), [Pose2(0.0, 0.0, 0.0)]
    rebuild = MapRebuild(scans, poses, Box(-50.0, -40.0, 60.0, 40.0), Mapper(), GridConfig(0.1))
    live = OccupancyGrid(GridConfig(0.1))
    rebuild.make_room(live)
    arrays = rebuild.grid.log_odds, rebuild.grid.state
    while not rebuild.step(1, math.inf):
        pass
    assert rebuild.grid.log_odds is arrays[0]
    assert rebuild.grid.state is arrays[1]
    Mapper().insert(scans[0].scan, Pose2(start_x_m, 0.0, 0.0), live)
    assert rebuild.joined_with(live) is live
    ny, nx = live.shape
    assert nx * 0.1 < (start_x_m + 20.0) * 1.6
    assert ny * 0.1 < 20.0
    dx, dy = (a - b for a, b in zip(rebuild.grid.offset, live.offset, strict=True))
    iy, ix = np.nonzero(rebuild.grid.state)
    assert np.array_equal(np.argwhere(live.state), np.column_stack((iy + dy, ix + dx)))
    assert (live.log_odds[iy + dy, ix + dx] == rebuild.grid.log_odds[iy, ix]).all()


def known(grid: OccupancyGrid):
    """Where something is known, on the lattice that all grids share, and what."""
    iy, ix = np.nonzero(grid.state)
    return (
        np.column_stack((ix, iy)) + grid.offset,
        grid.state[iy, ix],
        grid.log_odds[iy, ix],
        grid.hits[iy, ix],
    )


@pytest.mark.parametrize("start_x_m", [61.0, 100.0])
def test_a_large_grid_that_would_have_to_grow_is_not_changed_but_what_was_built_for_it(start_x_m: float):
    """It comes to the same as in a grid that has the room."""
    config, box = GridConfig(0.05), Box(60.0, -28.0, 150.0, 38.0)
    there = Pose2(start_x_m, 2.0, 0.0)  # at 61 m it votes beyond the box, too
    scans = kept(mapped(3.0))
    rebuild = MapRebuild(scans, [there], box, Mapper(), config)
    live, roomy = OccupancyGrid(config), OccupancyGrid(config)
    live.grow_to_contain((-150.0, -30.0), (63.5, 40.0))
    roomy.grow_to_contain((-150.0, -30.0), (170.0, 40.0))
    for grid in (live, roomy):
        for x_m in (-20.0, 30.0, 60.0):
            Mapper().insert(scans[0].scan, Pose2(x_m, 0.0, 0.0), grid)
    rebuild.make_room(live)
    assert rebuild.step(1, math.inf)
    assert rebuild.joined_with(roomy) is roomy
    joined = rebuild.joined_with(live)
    assert joined is rebuild.grid
    for ours, theirs in zip(known(joined), known(roomy), strict=True):
        assert np.array_equal(ours, theirs)
