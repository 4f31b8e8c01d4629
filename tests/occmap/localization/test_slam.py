import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from occmap.geometry import Pose2, wrap_angle
from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.map_localizer import MapLocalizer
from occmap.localization.pose_graph import Iteration
from occmap.localization.state_file import load, save
from occmap.localization.told_map import ToldMapConfig
from occmap.mapper import Mapper
from tests.occmap.kinematic_world import room
from tests.occmap.localization.drives import RING, RING_LAP, drive, errors_m, mapped, observe, scan_at

LAPS = drive([*RING_LAP, *RING_LAP, RING_LAP[0]])


@pytest.fixture(scope="module")
def ring():
    return observe(RING, LAPS, np.random.default_rng(0))


@pytest.fixture(scope="module")
def finished(ring):
    return mapped(ring)


def _poses(slam):
    return [pose for _, pose in slam.trajectory()]


def test_two_laps_of_drift_close(ring, finished):
    odometry = errors_m(LAPS, [seen.odom_from_robot for seen in ring])
    assert odometry.max() > 1.5
    assert errors_m(LAPS, _poses(finished)).max() < 0.1
    assert len(finished.loops.believed) > 5


def test_a_submaps_turn_to_the_next_is_known_as_well_as_it_is(ring):
    slam, began = SlamLocalizer(), [0]
    for k, seen in enumerate(ring):
        slam.update(seen)
        if len(slam.tracker.submaps) > len(began):
            began.append(k)
    links = zip(pairwise(began), slam.tracker.submaps[1:], strict=True)
    off_rad, sigma_rad = np.transpose(
        [
            (
                wrap_angle((LAPS[a].inverse() @ LAPS[b]).yaw_rad - link.previous_from_submap.yaw_rad),
                np.linalg.inv(link.information)[2, 2] ** 0.5,
            )
            for (a, b), link in links
        ]
    )
    assert 0.5 < np.sqrt(np.mean((off_rad / sigma_rad) ** 2)) < 2.0


def test_the_same_stream_gives_the_same_trajectory_to_the_bit(ring):
    first, second = mapped(ring[:150]), mapped(ring[:150])
    assert first.trajectory() == second.trajectory()


def test_what_was_handed_over_and_inserted_since_is_the_map(ring):
    often = SlamConfig(told=ToldMapConfig(moved_m=0.005, seam_m=1e-9))
    slam, mapper, grid, shifts = SlamLocalizer(often), Mapper(), None, []
    for seen in ring:
        estimate = slam.update(seen)
        if estimate.grid is not None:
            grid, shifts = estimate.grid, [*shifts, estimate.map_shift]
        if estimate.insert and grid is not None:
            mapper.insert(estimate.scan or seen.scan, estimate.map_from_robot @ seen.robot_from_lidar, grid)
    assert grid is not None
    assert all(0.0 < math.hypot(*shift.position) + abs(shift.yaw_rad) < 1.0 for shift in shifts)
    told = slam.told.fresh(slam.told.map_from_submap)
    low = np.array(told.offset) - np.array(grid.offset)
    ny, nx = told.shape
    same = grid.state[low[1] : low[1] + ny, low[0] : low[0] + nx] == told.state
    assert same.mean() > 0.995


def test_without_odometry_scans_alone_do(ring):
    blind = [replace(seen, odom_from_robot=Pose2(2.0, 1.0, 0.5)) for seen in ring]
    assert errors_m(LAPS, _poses(mapped(blind))).max() < 0.12


def test_wheels_that_count_backwards_as_forwards_are_found_out():
    """As in one of the public benchmark's logs."""
    there = drive([(1.5, 1.5), (6.0, 1.5)])
    back = there[::-1]
    stream = observe(RING, [*there, *back], np.random.default_rng(1))
    turning_point = stream[len(there) - 1].odom_from_robot
    lying = [
        replace(seen, odom_from_robot=turning_point @ Pose2(0.1 * k, 0.0, 0.0))
        for k, seen in enumerate(stream[len(there) :])
    ]
    slam = mapped([*stream[: len(there)], *lying])
    assert errors_m([*there, *back], _poses(slam)).max() < 0.06


def test_a_bare_corridor_is_as_long_as_the_wheels_say():
    boxes = np.array([(-50, 1.0, 50, 1.2), (-50, -1.2, 50, -1.0)], float)
    poses = [Pose2(0.1 * k, 0.0, 0.0) for k in range(200)]
    stream = observe(boxes, poses, np.random.default_rng(2), turn_error_per_m=0.0, max_range_m=8.0)
    slam = mapped(stream)
    estimates = _poses(slam)
    steps = np.array([a.distance_to(b) for a, b in pairwise(estimates)])
    assert steps.max() < 0.15
    assert estimates[-1].x_m == pytest.approx(stream[-1].odom_from_robot.x_m, rel=0.02)
    assert abs(estimates[-1].y_m) < 0.05
    assert not [loop for loop in slam.loops.believed if loop.younger - loop.older > 6]


def test_an_empty_hall_goes_by_odometry():
    poses = drive([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)])
    stream = observe(np.array([(90, 90, 91, 91)], float), poses, np.random.default_rng(3))
    slam = mapped(stream)
    for estimate, seen in zip(_poses(slam), stream, strict=True):
        assert estimate.distance_to(seen.odom_from_robot) < 0.02
    assert not slam.loops.believed


def test_saved_and_continued_is_as_one_run(ring, finished, tmp_path):
    first = SlamLocalizer()
    for seen in ring[:200]:
        first.update(seen)
    save(tmp_path / "state", first)
    second = load(tmp_path / "state")
    for seen in ring[200:]:
        second.update(seen)
    second.finish()
    assert second.trajectory() == finished.trajectory()
    assert np.array_equal(second.map().log_odds, finished.map().log_odds)


def test_a_finished_map_can_be_continued(ring):
    slam = mapped(ring[: len(ring) // 2])
    for seen in ring[len(ring) // 2 :]:
        slam.update(seen)
    slam.finish()
    assert errors_m(LAPS, _poses(slam)).max() < 0.1


@pytest.mark.parametrize(
    ("was_settled", "iterations", "is_told"),
    [(False, [True], True), (True, [False, True], True), (False, [False, True], True), (True, [True], False)],
)
def test_what_settles_as_a_submap_begins_is_told(ring, monkeypatch, was_settled, iterations, is_told):
    """At once, or one iteration later in the same turn."""
    slam, told, left = SlamLocalizer(), [], iterations.copy()
    for seen in ring[:114]:
        slam.update(seen)
    submaps = len(slam.graph.poses)
    slam._settled = was_settled
    monkeypatch.setattr(slam.told, "correct", lambda poses: told.append(poses) or True)
    monkeypatch.setattr(slam.graph, "iterate", lambda: Iteration(0.0, 0.0, True, converged=left.pop(0)))
    slam.update(ring[114])
    assert len(slam.graph.poses) == submaps + 1
    assert bool(told) == is_told
    assert not left


def test_a_file_of_another_kind_is_refused(tmp_path):
    (tmp_path / "state").write_bytes(b"something else")
    with pytest.raises(ValueError, match="not a saved SLAM state"):
        load(tmp_path / "state")


@pytest.mark.parametrize("start", [None, Pose2(5.0, 5.0, 2.5)])
def test_the_robot_is_found_in_a_finished_map(finished, start):
    rng = np.random.default_rng(5)
    poses = drive([(12.5, 3.0), (12.5, 8.5), (4.0, 8.5)])
    stream = observe(RING, poses, rng)
    localizer = MapLocalizer(finished, start)
    estimates = [localizer.update(seen) for seen in stream]
    world_from_map = LAPS[0]
    off = [(world_from_map @ e.map_from_robot).distance_to(p) for e, p in zip(estimates, poses, strict=True)]
    assert max(off[60:]) < 0.1
    assert not localizer.is_lost
    assert not any(e.insert for e in estimates)
    assert estimates[0].grid is not None


def test_a_known_start_is_followed_at_once(finished):
    poses = drive([(12.5, 3.0), (12.5, 8.5)])
    stream = observe(RING, poses, np.random.default_rng(6))
    localizer = MapLocalizer(finished, LAPS[0].inverse() @ poses[0])
    for seen, pose in zip(stream, poses, strict=True):
        assert (LAPS[0] @ localizer.update(seen).map_from_robot).distance_to(pose) < 0.1


def test_a_turning_lidar_is_undistorted_before_it_is_matched():
    """Each beam is cast from where the robot was at that instant."""
    rng = np.random.default_rng(7)
    poses = [Pose2(5.0, 1.5, 0.1 * k) for k in range(60)]
    stream = observe(RING, poses, rng, noise_scale=0.0)
    spun = []
    for seen, pose in zip(stream, poses, strict=True):
        times = np.linspace(-0.2, 0.0, 180)
        early = scan_at(RING, pose @ Pose2(0.0, 0.0, -0.1), rng, 0.0, beams=36000)
        ranges = np.interp(
            seen.scan.bearings_rad + 0.1 * times / 0.2 + 0.1,
            early.bearings_rad,
            early.ranges_m,
            period=2 * math.pi,
        )
        spun.append(replace(seen, scan=replace(seen.scan, ranges_m=ranges, beam_times_s=times)))
    slam = SlamLocalizer()
    estimates = [slam.update(seen) for seen in spun]
    assert estimates[-1].scan is not None
    assert estimates[-1].scan.beam_times_s is None
    slam.finish()
    assert errors_m(poses, _poses(slam))[2:].max() < 0.06


def test_a_turning_lidar_at_rest_is_averaged_though_the_wheels_flicker():
    """Nothing is undistorted while the robot stands: all looks are of the same beams."""
    rng = np.random.default_rng(8)
    still = observe(RING, [Pose2(5.0, 1.5, 0.3)] * 12, rng)
    wheels = [Pose2(0.0, 0.0, 0.001 * (k % 2)) for k in range(12)]
    flicker = [replace(seen, odom_from_robot=odom) for seen, odom in zip(still, wheels, strict=True)]
    times = np.linspace(-0.2, 0.0, 180)
    turning = [replace(seen, scan=replace(seen.scan, beam_times_s=times)) for seen in flicker]
    at_once, spun = (mapped(stream).tracker.submaps[0].rows for stream in (flicker, turning))
    np.testing.assert_array_equal(spun, at_once)


def test_few_beams_do_not_hold_back_a_robot_that_turns_where_it_stood():
    """All looks from the start went along the same 72 beams: posts, had the walls not been filled in."""
    turns = np.concatenate((np.zeros(12), np.arange(0.05, 4.0, 0.05)))
    off_rad = []
    for seed in range(4):
        poses = [Pose2(7.0, 1.6, 0.4 + turn) for turn in turns]
        stream = observe(RING, poses, np.random.default_rng(seed), beams=72)
        short = [
            replace(seen, odom_from_robot=Pose2(0.0, 0.0, 0.98 * turn))
            for seen, turn in zip(stream, turns, strict=True)
        ]
        slam = mapped(short)
        off_rad.append(_poses(slam)[-1].yaw_rad - wrap_angle(turns[-1]))
    assert np.abs(off_rad).max() < math.radians(0.2)


def test_noise_does_not_cut_the_first_look_short():
    """The first scan is as noisy as any: all others may lie to one side of it."""
    hall = room(16.0, 12.0, (6, 5, 6.5, 6))
    for seed in range(6):
        still = observe(
            hall, [Pose2(5.0, 4.5, 0.3)] * 30, np.random.default_rng(seed), noise_scale=2.0, beams=360
        )
        slam = SlamLocalizer()
        for seen in still:
            slam.update(seen)
        assert not slam.tracker.first_look.is_over
        assert len(slam.tracker.first_look) == 30


def test_a_scan_that_fits_anywhere_along_a_corridor_does_not_move_wheels_that_stand():
    """Least of all the second one, before the wheels have flickered: there might be none."""
    corridor = np.array([(-50, 1.0, 50, 1.2), (-50, -1.2, 50, -1.0)], float)
    for seed in range(6):
        still = observe(corridor, [Pose2.identity()] * 12, np.random.default_rng(seed), max_range_m=8.0)
        wheels = [Pose2(0.0, 0.0, 0.001 * (k >= 2)) for k in range(12)]
        slam = mapped([replace(seen, odom_from_robot=odom) for seen, odom in zip(still, wheels, strict=True)])
        assert all(pose == Pose2.identity() for pose in _poses(slam))
