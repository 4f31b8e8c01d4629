"""What a scan leaves free: the kernels against plain NumPy."""

import math

import numpy as np
import pytest

from occmap import surroundings_kernels as kernels
from occmap.clearance import ClearanceMap
from occmap.geometry import Pose2, Twist2
from occmap.grid import Belief, OccupancyGrid
from occmap.scan import Scan
from occmap.surroundings import Base, Surroundings, SurroundingsConfig


def near_hits(ranges, bearings, low, high, reach, gate, half_window, lidar):
    """The twin: points with and without a neighbour on the same surface."""
    hits, lone = [], []
    for i, r in enumerate(ranges):
        if not (low <= r <= reach and r < high):
            continue
        around = [ranges[(i + k) % len(ranges)] for k in range(-half_window, half_window + 1)]
        same = [other for other in around if abs(other - r) < gate]
        angle = bearings[i] + lidar[2]
        point = np.mean(same) * np.array([math.cos(angle), math.sin(angle)]) + lidar[:2]
        (hits if len(same) > 1 else lone).append(point)
    return np.array(hits).reshape(-1, 2), np.array(lone).reshape(-1, 2)


@pytest.mark.parametrize("seed", range(5))
def test_near_hits_are_what_the_twin_finds(seed):
    rng = np.random.default_rng(seed)
    bearings = np.linspace(-math.pi, math.pi, 90, endpoint=False)
    ranges = np.repeat(rng.uniform(0.02, 3.0, 30), 3) + rng.normal(0.0, 0.03, 90)
    ranges[rng.integers(0, 90, 6)] = np.nan
    ranges[rng.integers(0, 90, 6)] = np.inf
    lidar = (0.1, -0.05, 0.3)
    hits, lone = np.empty((90, 2)), np.empty((90, 2))
    n_hits, n_lone = kernels.near_hits(ranges, bearings, 0.05, 12.0, 1.5, 0.1, 3, *lidar, hits, lone)
    expected_hits, expected_lone = near_hits(ranges, bearings, 0.05, 12.0, 1.5, 0.1, 3, lidar)
    np.testing.assert_allclose(hits[:n_hits], expected_hits)
    np.testing.assert_allclose(lone[:n_lone], expected_lone)
    assert n_hits > 10


def test_averaging_leaves_a_third_of_the_noise():
    rng = np.random.default_rng(0)
    bearings = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    hits, lone = np.empty((360, 2)), np.empty((360, 2))
    ranges = 0.5 + rng.normal(0.0, 0.0225, 360)
    n_hits, _ = kernels.near_hits(ranges, bearings, 0.05, 12.0, 1.5, 0.1, 3, 0.0, 0.0, 0.0, hits, lone)
    assert n_hits == 360
    assert np.hypot(*hits.T).std() < 0.5 * ranges.std()


def test_a_lone_return_counts_where_the_map_has_something():
    clearance = np.full((40, 40), 1.0, np.float32)
    clearance[20, 30] = 0.0  # the cell of (1.525, 1.025)
    lone = np.array([[0.5, 0.0], [0.0, 0.5]])
    hits = np.empty((5, 2))
    assert kernels.keep_believed(lone, 2, hits, 0, 1.0, 1.02, 0.0, clearance, 0.0, 0.0, 0.05, 0.07) == 1
    np.testing.assert_array_equal(hits[0], lone[0])
    assert kernels.keep_believed(lone, 2, hits, 0, 1.52, 0.5, 0.0, clearance, 0.0, 0.0, 0.05, 0.07) == 1
    np.testing.assert_array_equal(hits[0], lone[1])


def test_a_stop_is_foreseen_exactly_when_braking_would_end_in_an_obstacle():
    """v = 0.5, held 0.3 s, then 1 m/s2: the disc needs 0.15 + 0.125 m and a little for the discrete ramp."""
    for distance_m, is_free in [(0.19 + 0.30, True), (0.19 + 0.24, False)]:
        hits = np.array([[distance_m, 0.0]])
        assert kernels.is_free(0.5, 0.0, 0.5, 0.0, 0.3, 1.0, 3.0, hits, 0.19) == is_free


def test_who_stands_too_near_may_leave_but_not_go_nearer():
    too_near = np.array([[0.18, 0.0]])
    assert kernels.is_free(0.0, 0.0, -0.1, 0.0, 0.3, 1.0, 3.0, too_near, 0.19)
    assert not kernels.is_free(0.0, 0.0, 0.1, 0.0, 0.3, 1.0, 3.0, too_near, 0.19)


def test_turning_in_place_is_always_free():
    hits = np.array([[0.18, 0.0], [0.0, 0.18], [-0.18, 0.0]])
    assert kernels.is_free(0.0, 0.0, 0.0, 1.5, 0.3, 1.0, 3.0, hits, 0.19)


def test_what_all_but_touches_moves_on_only_to_where_there_is_more_room():
    """Between walls that keep their distance a scan's noise would let it creep on; backwards it may go."""
    along = np.linspace(-1.0, 1.0, 201)

    def drives(half_m, widening, v):
        sides = [np.column_stack((along, side * (half_m + widening * along))) for side in (-1.0, 1.0)]
        return kernels.is_free(0.0, 0.0, v, 0.0, 0.8, 1.0, 3.0, np.concatenate(sides), 0.19)

    assert drives(0.185, 0.0, 0.12)
    assert not drives(0.175, 0.0, 0.12)
    assert drives(0.175, 0.0, -0.12)
    assert drives(0.175, 0.2, 0.12)
    assert not drives(0.175, -0.2, 0.12)


@pytest.mark.parametrize(("behind_m", "may_back"), [(0.25, False), (0.5, True)])
def test_behind_a_lidar_that_looks_ahead_the_map_is_asked(behind_m, may_back):
    grid, clearance = OccupancyGrid(), ClearanceMap()
    grid.grow_to_contain((-1.0, -1.0), (1.0, 1.0))
    grid.state[:] = Belief.FREE
    grid.state[:, grid.frame.cell_at(-behind_m, 0.0)[0]] = Belief.OCCUPIED
    clearance.rebuild(grid)
    around = Surroundings(Base(0.19, 1.0, 3.0))
    ahead = Scan(np.linspace(-1.0, 1.0, 90), np.full(90, 3.0), 12.0)
    around.look(ahead, Pose2.identity(), Pose2.identity(), grid, clearance.distance_m)
    assert around.is_free(Twist2.zero(), Twist2(-0.12, 0.0), 0.5) == may_back
    assert around.is_free(Twist2.zero(), Twist2(0.12, 0.0), 0.5)


def test_the_free_bearing_is_the_nearest_one():
    open_floor = np.array([[5.0, 5.0]])
    assert kernels.free_bearing(0.4, 0.9, 0.1, open_floor, 0.19) == pytest.approx(0.4)
    ahead = np.array([[0.25, 0.05]])  # a little to the left: pass on the right
    assert -0.9 < kernels.free_bearing(0.0, 0.9, 0.1, ahead, 0.19) < 0.0
    wall = np.column_stack((np.full(60, 0.25), np.linspace(-1.0, 1.0, 60)))
    assert math.isnan(kernels.free_bearing(0.0, 0.9, 0.1, wall, 0.19))


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="neighbours at least 1"):
        SurroundingsConfig(neighbours=0)
