"""The way ahead: the kernels against plain NumPy, and what centring is for."""

import numpy as np
import pytest

from occmap import way_kernels as kernels
from occmap.path import Path
from occmap.way import WayConfig

AHEAD = np.column_stack((np.arange(28) * 0.05, np.zeros(28)))
"""Straight on for 1.35 m."""


def rooms(way, hits, beside_m, reach_m):
    """The twin, for a way straight along x."""
    offset = hits[None] - way[:, None]
    distance = np.minimum(np.hypot(offset[..., 0], offset[..., 1]), reach_m)
    beside = np.abs(offset[..., 0]) < beside_m
    left = np.where(beside & (offset[..., 1] > 0), distance, reach_m).min(axis=1)
    right = np.where(beside & (offset[..., 1] <= 0), distance, reach_m).min(axis=1)
    return np.column_stack((left, right, distance.min(axis=1)))


def test_rooms_are_what_the_twin_finds():
    hits = np.random.default_rng(0).uniform((-0.3, -0.6), (1.5, 0.6), (80, 2))
    np.testing.assert_allclose(kernels.rooms(AHEAD, hits, 0.2, 0.35), rooms(AHEAD, hits, 0.2, 0.35))


def test_the_way_moves_to_the_middle_of_a_gap_and_only_there():
    jambs = np.array([[1.0, 0.26], [1.0, -0.18]])  # 0.44 m wide, its middle 0.04 m to the left
    way = AHEAD.copy()
    room = kernels.centre(way, jambs, 0.2, 0.35, 0.15, 8)
    assert way[20, 1] == pytest.approx(0.04, abs=0.012)
    np.testing.assert_array_equal(way[:4], AHEAD[:4])
    assert room[20, 2] > 0.2
    untouched = AHEAD.copy()
    kernels.centre(untouched, np.array([[1.0, 0.5], [0.5, -0.4]]), 0.2, 0.35, 0.15, 8)
    np.testing.assert_array_equal(untouched, AHEAD)


def test_alignment_asks_whether_the_robot_is_on_the_line_through_the_gap():
    room = np.full((28, 3), 0.35)
    assert kernels.alignment(AHEAD, room, 0.27, 14) == 1.0
    room[10, 2] = 0.22
    assert kernels.alignment(AHEAD, room, 0.27, 14) == pytest.approx(1.0)
    assert kernels.alignment(AHEAD + np.array([0.0, 0.06]), room, 0.27, 14) == pytest.approx(0.5)
    assert kernels.alignment(AHEAD + np.array([0.0, 0.2]), room, 0.27, 14) == 0.0


def test_the_speed_falls_beside_obstacles_and_before_bends():
    room = np.full((28, 3), 0.35)
    limits = 0.05, 0.5, 0.12, 0.2, 0.35, 1.2, 0.5
    assert kernels.speed_limit(AHEAD, room, *limits) == 0.5
    close = room.copy()
    close[:3, 2] = 0.2
    assert kernels.speed_limit(AHEAD, close, *limits) == pytest.approx(0.12)
    hairpin = np.vstack((AHEAD[:6], AHEAD[:6][::-1] + np.array([0.0, 0.05])))
    assert 0.12 <= kernels.speed_limit(hairpin, room[:12], *limits) < 0.45


def test_the_aim_is_not_seen_through_a_corner():
    bend = np.vstack((AHEAD[:10], np.column_stack((np.full(10, 0.45), np.arange(1, 11) * 0.05))))
    nothing, corner = np.empty((0, 2)), np.array([[0.22, 0.23]])
    assert kernels.farthest_aim(bend, nothing, 0.05, 0.25, 0.9, 0.2) == 18
    aim = kernels.farthest_aim(bend, corner, 0.05, 0.25, 0.9, 0.2)
    assert 5 <= aim < 14


def test_samples_of_a_path_are_evenly_spaced_and_end_with_it():
    path = Path.through(np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]))
    way = np.empty((28, 2))
    n = kernels.sample_path(path.waypoints_in_map, path.stations_m, 0.2, 0.05, 0.2, 0.0, np.pi / 2, way)
    assert n == 17
    np.testing.assert_allclose(way[0], (0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(way[n - 1], (0.5, -0.3), atol=1e-9)  # the robot looks up the page
    np.testing.assert_allclose(np.hypot(*np.diff(way[:n], axis=0).T), 0.05)


def test_progress_follows_the_robot_and_does_not_jump_to_a_later_pass():
    """A hairpin: the way back runs 0.2 m beside the way out."""
    points = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 0.2], [0.0, 0.2]])
    stations = Path.through(points).stations_m
    at_m, off_m = kernels.place_on_path(points, stations, 1.0, 0.15, 0.7, 2.0)
    assert at_m == pytest.approx(1.0)
    assert off_m == pytest.approx(0.15)


def test_the_nearest_point_of_a_path_is_what_brute_force_finds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        points = rng.uniform(-2, 2, (6, 2))
        stations = Path.through(points).stations_m
        x, y = rng.uniform(-2, 2, 2)
        dense = np.linspace(0.0, stations[-1], 20001)
        places = np.column_stack([np.interp(dense, stations, points[:, k]) for k in (0, 1)])
        _, off_m = kernels.place_on_path(points, stations, x, y, 0.0, np.inf)
        assert off_m == pytest.approx(np.hypot(*(places - (x, y)).T).min(), abs=1e-3)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="spacing_m < length_m"):
        WayConfig(spacing_m=0.0)
