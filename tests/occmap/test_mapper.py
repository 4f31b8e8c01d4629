"""The mapper: every vote where the lesson casts it, and the belief that follows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.mapper import GridChange, Mapper
from occmap.rays import ray_cells
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig, vote
from tests.scans import AHEAD, at, beams

HIT, MISS = 0.85, -0.40


def random_scan(rng: np.random.Generator, n: int = 360) -> Scan:
    ranges = rng.uniform(0.0, 5.0, n)
    ranges[rng.random(n) < 0.1] = np.inf
    ranges[rng.random(n) < 0.1] = np.nan
    return beams(np.linspace(-math.pi, math.pi, n, endpoint=False), ranges, 4.5)


def random_pose(rng: np.random.Generator) -> Pose2:
    return Pose2(*rng.uniform(-2.0, 2.0, 2), rng.uniform(-math.pi, math.pi))


def without_lone_no_returns(scan: Scan, company: int = 3) -> Scan:
    """Beams between returns that met nothing say nothing, unless `company` of them stand together."""
    speaking = np.flatnonzero(scan.ranges_m >= scan.min_range_m)
    nothing = scan.ranges_m[speaking] >= scan.max_range_m
    ranges = scan.ranges_m.copy()
    if not nothing.all():
        first_return = int(np.argmin(nothing))
        turned, beams_in_turn = np.roll(nothing, -first_return), np.roll(speaking, -first_return)
        runs = np.split(np.arange(len(turned)), np.flatnonzero(np.diff(turned)) + 1)
        for run in runs:
            if turned[run[0]] and len(run) < company:
                ranges[beams_in_turn[run]] = np.nan
    return beams(scan.bearings_rad, ranges, scan.max_range_m, scan.min_range_m)


def votes_twin(scan: Scan, pose: Pose2, grid: OccupancyGrid, half_width: float = 0.0, alpha_m: float = 0.0):
    """(ny, nx) misses and hits of one scan, beam by beam in plain NumPy."""
    misses, hits = np.zeros(grid.shape, int), np.zeros(grid.shape, int)
    start = grid.frame.cell_at(*pose.position)
    iy, ix = np.indices(grid.shape)
    centres = grid.frame.map_from_cell(np.stack((ix, iy), axis=-1)) - pose.position
    r = np.hypot(*np.moveaxis(centres, -1, 0))
    for bearing, z in zip(scan.bearings_rad, scan.ranges_m, strict=True):
        if not z >= scan.min_range_m:
            continue
        reached, is_hit = min(z, scan.max_range_m), z < scan.max_range_m
        direction = np.array([math.cos(pose.yaw_rad + bearing), math.sin(pose.yaw_rad + bearing)])
        if half_width:
            along = centres @ direction
            across = np.abs(centres @ np.array([-direction[1], direction[0]]))
            half_cell = grid.config.resolution_m / 2
            inside = (along >= -half_cell) & (across <= np.maximum(along * math.tan(half_width), half_cell))
            said = np.vectorize(vote)(r, reached, math.inf if is_hit else reached, max(alpha_m, half_cell))
            misses += inside & (said < 0)
            hits += inside & (said > 0)
            continue
        end = grid.frame.cell_at(*(np.array(pose.position) + reached * direction))
        *crossed, last = ray_cells(*start, *end).tolist()
        for cx, cy in crossed if is_hit else [*crossed, last]:
            misses[cy, cx] += 1
        hits[last[1], last[0]] += is_hit
    return misses, hits


def belief_twin(log_odds: np.ndarray, misses: np.ndarray, hits: np.ndarray, one_vote: bool) -> np.ndarray:
    if one_vote:
        misses, hits = (misses > 0) & (hits == 0), hits > 0
    after_misses = np.maximum(log_odds + misses * MISS, -6.0)
    return np.minimum(after_misses + hits * HIT, 6.0)


@pytest.mark.parametrize("one_vote", [False, True])
def test_the_kernel_equals_its_twin_and_reports_every_change(one_vote: bool):
    rng = np.random.default_rng(0)
    mapper, grid = Mapper(SensorModelConfig(one_vote_per_scan=one_vote)), OccupancyGrid()
    mapper.insert(beams([], []), Pose2.identity(), grid)
    grid.grow_to_contain((-7.0, -7.0), (7.0, 7.0))
    for _ in range(25):
        scan, pose = random_scan(rng), random_pose(rng)
        expected = belief_twin(
            grid.log_odds.astype(float), *votes_twin(without_lone_no_returns(scan), pose, grid), one_vote
        )
        before = grid.state.copy()
        change = mapper.insert(scan, pose, grid)
        assert not change.grew
        np.testing.assert_allclose(grid.log_odds, expected, atol=1e-4)
        assert_state_is_the_thresholded_belief(grid)
        assert_change_is_the_difference(change, before, grid.state)


def assert_state_is_the_thresholded_belief(grid: OccupancyGrid):
    expected = np.full(grid.shape, Belief.UNKNOWN, np.uint8)
    expected[grid.log_odds < grid.free_below] = Belief.FREE
    expected[grid.log_odds > grid.occupied_above] = Belief.OCCUPIED
    np.testing.assert_array_equal(grid.state, expected)


def assert_change_is_the_difference(change: GridChange, before: np.ndarray, after: np.ndarray):
    flipped = np.flatnonzero(before != after)
    np.testing.assert_array_equal(np.sort(change.flat_cells), flipped)
    np.testing.assert_array_equal(change.was, before.ravel()[change.flat_cells])


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_the_order_of_beams_does_not_change_the_map(seed: int, one_vote: bool):
    rng = np.random.default_rng(seed)
    mapper = Mapper(SensorModelConfig(one_vote_per_scan=one_vote))
    scan, pose, shuffled = random_scan(rng), random_pose(rng), rng.permutation(360)
    grids = OccupancyGrid(), OccupancyGrid()
    mapper.insert(scan, pose, grids[0])
    mapper.insert(beams(scan.bearings_rad[shuffled], scan.ranges_m[shuffled], 4.5), pose, grids[1])
    np.testing.assert_array_equal(grids[0].log_odds, grids[1].log_odds)


def test_the_order_of_scans_and_growth_do_not_change_the_map():
    rng = np.random.default_rng(1)
    mapper = Mapper(SensorModelConfig(hit_log_odds=0.02, miss_log_odds=-0.01))  # far from the clamp
    scans = [(random_scan(rng), random_pose(rng)) for _ in range(8)]
    grids = OccupancyGrid(), OccupancyGrid()
    for grid, order in zip(grids, (scans, scans[::-1]), strict=True):
        for scan, pose in order:
            mapper.insert(scan, pose, grid)
        grid.grow_to_contain((-9.0, -9.0), (9.0, 9.0))
    for cell in np.argwhere(grids[0].log_odds)[::7]:
        x_m, y_m = grids[0].frame.centre_of(int(cell[1]), int(cell[0]))
        assert at(grids[1], x_m, y_m) == pytest.approx(at(grids[0], x_m, y_m), abs=1e-4)
    assert grids[0].log_odds.sum() == pytest.approx(grids[1].log_odds.sum(), rel=1e-4)


def test_a_beam_that_met_nothing_frees_its_whole_length_and_occupies_nothing():
    for z in (math.inf, 12.0, 13.0):
        mapper, grid = Mapper(), OccupancyGrid()
        mapper.insert(beams(AHEAD, [z]), Pose2(0.01, 0.01, 0.0), grid)
        assert int((grid.log_odds < 0.0).sum()) == 241  # 12 m and the robot's own cell
        assert not (grid.log_odds > 0.0).any()


def fan(no_returns: list[int]) -> Scan:
    """A round room of 2 m radius, seen by 360 beams; these got no answer."""
    ranges = np.full(360, 2.0)
    ranges[no_returns] = np.inf
    return beams(np.arange(360) * 2.0 * math.pi / 360, ranges)


def freed_beyond_the_wall(scan: Scan, config: SensorModelConfig | None = None) -> bool:
    mapper, grid = Mapper(config), OccupancyGrid()
    mapper.insert(scan, Pose2.identity(), grid)
    iy, ix = np.nonzero(grid.log_odds < 0.0)
    return bool((np.hypot(*grid.frame.map_from_cell(np.column_stack((ix, iy))).T) > 2.2).any())


def test_a_lost_echo_between_returns_opens_no_line_through_the_wall():
    assert not freed_beyond_the_wall(fan([90]))
    assert not freed_beyond_the_wall(fan([0, 359]))
    assert freed_beyond_the_wall(fan([90]), SensorModelConfig(no_returns_in_company=1))


def test_three_neighbours_that_met_nothing_are_believed_also_around_a_failed_one():
    assert freed_beyond_the_wall(fan([359, 0, 1]))
    holed = fan([10, 11, 13])
    holed.ranges_m[12] = math.nan
    assert freed_beyond_the_wall(holed)


def test_where_no_neighbour_is_near_a_single_beam_that_met_nothing_is_believed():
    assert freed_beyond_the_wall(beams([0.0, 1.0, 2.0], [2.0, math.inf, 2.0]))
    assert freed_beyond_the_wall(beams([0.0, 0.05, 0.1, 0.15], [2.0, 2.0, 2.0, math.inf]))  # the fan's edge


@pytest.mark.parametrize("z", [math.nan, 0.04, -math.inf, -1.0])
def test_failed_and_too_short_beams_say_nothing(z: float):
    mapper, grid = Mapper(), OccupancyGrid()
    change = mapper.insert(beams(AHEAD, [z]), Pose2.identity(), grid)
    assert not grid.log_odds.any()
    assert len(change.flat_cells) == 0


def test_beams_are_spent_no_farther_than_their_usable_range():
    mapper, grid = Mapper(SensorModelConfig(usable_range_m=2.0)), OccupancyGrid()
    mapper.insert(beams([0.0, math.pi / 2], [3.0, 1.0]), Pose2(0.01, 0.01, 0.0), grid)
    assert at(grid, 1.99, 0.01) < 0.0
    assert grid.frame.cell_at(2.5, 0.0)[0] >= grid.shape[1]
    assert at(grid, 0.01, 1.01) > 0.0


def test_rays_that_graze_a_wall_do_not_erase_it():
    """A corridor's wall seen at a flat angle: its cells are crossed more often than they are hit."""
    mapper, grid = Mapper(SensorModelConfig(one_vote_per_scan=True)), OccupancyGrid()
    bearings = np.linspace(0.02, 0.6, 400)
    for _ in range(20):
        mapper.insert(
            beams(bearings, np.minimum(0.52 / np.sin(bearings), np.inf)), Pose2(0.01, 0.01, 0.0), grid
        )
    hits = [(0.01 + 0.52 / math.tan(b), 0.53) for b in bearings if 0.52 / math.sin(b) < 12.0]
    assert all(at(grid, *place) == 6.0 for place in hits)


def test_hits_count_after_misses_that_saturate():
    """A thin leg before a wall: hundreds of rays pass through its cell, one hits it, and it shows."""
    mapper, grid = Mapper(), OccupancyGrid()
    ranges = np.full(200, 3.0)
    ranges[0] = 1.0
    mapper.insert(beams(np.zeros(200), ranges), Pose2(0.01, 0.01, 0.0), grid)
    assert at(grid, 1.01, 0.01) == pytest.approx(-6.0 + HIT)


def test_thickness_of_10_cm_paints_a_wall_five_cells_thick():
    mapper, grid = Mapper(SensorModelConfig(obstacle_thickness_m=0.10)), OccupancyGrid()
    mapper.insert(beams(AHEAD, [3.0]), Pose2(0.025, 0.025, 0.0), grid)
    occupied = np.argwhere(grid.log_odds > 0.0)
    assert len(occupied) == 5
    assert grid.frame.map_from_cell(occupied[:, ::-1])[:, 0].tolist() == pytest.approx(
        [2.925, 2.975, 3.025, 3.075, 3.125]
    )
    assert at(grid, 2.87, 0.025) == pytest.approx(MISS)


@pytest.mark.parametrize("alpha_m", [0.0, 0.1])
def test_a_wide_beam_votes_on_the_wedge_like_its_twin(alpha_m: float):
    rng = np.random.default_rng(2)
    config = SensorModelConfig(beam_width_rad=math.radians(25.0), obstacle_thickness_m=alpha_m)
    mapper, grid = Mapper(config), OccupancyGrid(GridConfig(resolution_m=0.1))
    sonar = beams(np.linspace(-math.pi, math.pi, 12, endpoint=False), rng.uniform(0.3, 6.0, 12), 5.0)
    pose = random_pose(rng)
    mapper.insert(sonar, pose, grid)
    misses, hits = votes_twin(sonar, pose, grid, math.radians(12.5), alpha_m)
    np.testing.assert_allclose(grid.log_odds, belief_twin(0.0 * misses, misses, hits, False), atol=1e-5)
    assert_state_is_the_thresholded_belief(grid)


def test_a_wide_beam_learns_more_cells_than_a_thin_one():
    known = []
    for width in (0.0, math.radians(15.0), math.radians(30.0)):
        mapper, grid = Mapper(SensorModelConfig(beam_width_rad=width)), OccupancyGrid()
        mapper.insert(beams(AHEAD, [3.0]), Pose2.identity(), grid)
        known.append(np.count_nonzero(grid.log_odds))
    assert 3 * known[0] < known[1] < known[2]


@pytest.mark.parametrize("config", [SensorModelConfig(), SensorModelConfig(beam_width_rad=0.4)])
def test_the_grid_grows_no_farther_than_the_beams_reach(config: SensorModelConfig):
    mapper, grid = Mapper(config), OccupancyGrid()
    assert mapper.insert(beams([0.0, 1.0], [2.0, 3.0]), Pose2.identity(), grid).grew
    ny, nx = grid.shape
    slack = 2 * (0.1 + 12.1 * math.tan(config.beam_width_rad / 2))
    assert nx * 0.05 < 2.0 + slack + 0.2
    assert ny * 0.05 < 3.0 * math.sin(1.0) + slack + 0.2


def test_a_range_of_zero_says_nothing():
    mapper, grid = Mapper(), OccupancyGrid()
    mapper.insert(beams([0.0, 1.0], [0.0, 3.0], min_range_m=0.0), Pose2.identity(), grid)
    assert np.count_nonzero(grid.hits) == 1


def test_a_sensor_of_endless_range_is_refused_unless_told_how_far_to_use_it():
    endless = beams(AHEAD, [math.inf], max_range_m=math.inf)
    with pytest.raises(ValueError, match="must be finite"):
        Mapper().insert(endless, Pose2.identity(), OccupancyGrid())
    Mapper(SensorModelConfig(usable_range_m=5.0)).insert(endless, Pose2.identity(), OccupancyGrid())


def test_single_precision_scans_are_taken_too():
    mapper, grid = Mapper(), OccupancyGrid()
    scan = Scan(np.zeros(2, np.float32)[::2], np.full(2, 3.0, np.float32)[::2], 12.0)
    mapper.insert(scan, Pose2(0.01, 0.01, 0.0), grid)
    assert at(grid, 3.02, 0.01) == pytest.approx(HIT)


def test_a_scan_of_more_beams_than_can_be_counted_is_refused():
    with pytest.raises(ValueError, match="at most 65534 beams, got 70000"):
        Mapper().insert(beams(np.zeros(70_000), np.ones(70_000)), Pose2.identity(), OccupancyGrid())


def test_hits_are_counted_where_beams_end():
    grid, mapper = OccupancyGrid(GridConfig(resolution_m=0.1)), Mapper()
    scan = beams([0.0, 1e-6, 1.0, 2.0], [1.03, 1.03, math.inf, math.nan], 3.0)
    changes = [mapper.insert(scan, Pose2.identity(), grid) for _ in range(3)]
    ix, iy = grid.frame.cell_at(1.03, 0.0)
    assert grid.hits[iy, ix] == 6
    assert np.count_nonzero(grid.hits) == 1
    told = [change.now_struck.tolist() for change in changes]
    assert told == [[iy * grid.shape[1] + ix], [iy * grid.shape[1] + ix], []]  # of the first and the fourth
    before = grid.hits.sum()
    grid.grow_to_contain((-20.0, -20.0), (0.0, 0.0))
    assert grid.hits.shape == grid.shape
    assert grid.hits[grid.frame.cell_at(1.03, 0.0)[::-1]] == before
