"""The follower drives a disc through noisy scans of rooms: it arrives, it is quick, and it never touches."""

import math

import numpy as np
import pytest

from occmap.body import Body
from occmap.follower import FollowerConfig
from occmap.geometry import Pose2, Twist2
from occmap.path import Path
from tests.occmap.kinematic_world import KinematicWorld, Mind, room

MAP_FROM_WORLD = Pose2(0.37, -0.21, 0.83)  # walls askew to the grid, as a random start makes them


def mind_in(boxes, pose, seed=0, noise_scale=1.0):
    world = KinematicWorld(boxes, pose, np.random.default_rng(seed), noise_scale)
    return world, Mind(world, MAP_FROM_WORLD)


def within_limits(world):
    return world.fastest[0] <= 0.5 + 1e-9 and world.fastest[1] <= 1.5 + 1e-9


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("thickness_m", "noise_scale"), [(0.1, 1.0), (0.04, 1.0), (0.6, 1.0), (0.1, 0.5)])
def test_a_gap_of_044_m_is_passed_without_touching(seed, thickness_m, noise_scale):
    rng = np.random.default_rng(100 + seed)
    low, high = 3.0 - 0.5 * thickness_m, 3.0 + 0.5 * thickness_m
    at = 2.0 + rng.uniform(-0.3, 0.3)
    boxes = room(6.0, 4.0, (low, 0.0, high, at - 0.22), (low, at + 0.22, high, 4.0))
    world, mind = mind_in(boxes, Pose2(1.0, rng.uniform(0.6, 3.4), rng.uniform(-3, 3)), seed, noise_scale)
    assert mind.drive((2.1, at), 30.0)  # to look through it
    assert mind.drive((4.8, at), 40.0)
    assert world.least_clearance_m > 0.005
    assert within_limits(world)


@pytest.mark.parametrize("seed", range(3))
def test_a_gap_too_narrow_is_refused_without_touching(seed):
    boxes = room(6.0, 4.0, (2.95, 0.0, 3.05, 1.83), (2.95, 2.17, 3.05, 4.0))
    world, mind = mind_in(boxes, Pose2(1.2, 1.8, 0.4), seed)
    assert mind.drive((2.1, 2.0), 20.0)
    assert not mind.drive((4.8, 2.0), 20.0)
    assert world.least_clearance_m > 0.0


def test_round_the_corners_of_a_corridor_it_is_quick_and_does_not_stop():
    boxes = room(8.0, 8.0, (0.0, 1.5, 6.5, 8.0))
    world, mind = mind_in(boxes, Pose2(0.7, 0.75, 0.0), 1)
    assert mind.drive((7.0, 0.75), 30.0)
    begun_s, begun_m, slowest = world.time_s, world.travelled_m, []
    mind.path = mind.steering = None
    while mind.steering is None or not mind.steering.arrived:
        mind.tick((0.8, 0.75))
        slowest.append(world.twist.linear_mps)
        assert world.time_s < begun_s + 30.0
    assert (world.travelled_m - begun_m) / (world.time_s - begun_s) > 0.4
    assert min(slowest[40:-15]) > 0.35
    assert world.least_clearance_m > 0.1
    assert within_limits(world)


def test_between_table_legs_it_touches_none():
    rng = np.random.default_rng(5)
    legs = [(x, y, x + 0.04, y + 0.04) for x, y in rng.uniform(1.2, 6.8, (16, 2))]
    world, mind = mind_in(room(8.0, 8.0, *legs), Pose2(0.6, 0.6, 0.0), 2)
    for goal in [(4.0, 0.6), (7.4, 3.5), (7.4, 7.4), (0.6, 7.4), (0.6, 0.6)]:
        mind.drive(goal, 40.0)
    assert world.pose.distance_to(Pose2(0.6, 0.6, 0.0)) < 0.15
    assert world.least_clearance_m > 0.02


@pytest.mark.parametrize("ahead_m", [0.5, 0.7, 1.0])
def test_it_stops_before_an_obstacle_that_appears(ahead_m):
    """The path is not planned anew: the scan alone must stop the robot."""
    boxes = room(10.0, 3.0)
    world, mind = mind_in(boxes, Pose2(1.0, 1.5, 0.0))
    path = straight(mind, (1.0, 1.5), (9.0, 1.5))
    steering = follow(mind, path)
    while world.pose.x_m < 3.0:
        world.step(steering.twist)
        steering = follow(mind, path)
    assert world.twist.linear_mps > 0.45
    world.boxes = np.vstack((boxes, (3.0 + ahead_m, 0.0, 3.1 + ahead_m, 3.0)))
    world.least_clearance_m = math.inf
    for _ in range(60):
        steering = follow(mind, path)
        world.step(steering.twist)
    assert world.least_clearance_m > 0.0
    assert steering.held_up_s > 1.0


def straight(mind, begin, end):
    return Path.through(mind.map_from_world.apply(np.array([begin, end])))


def follow(mind, path):
    scan = mind.see()
    return mind.follower.follow(
        path,
        mind.map_from_robot,
        mind.world.twist,
        scan,
        Pose2.identity(),
        mind.grid,
        mind.clearance.distance_m,
    )


def test_it_backs_out_of_inflation():
    """Nose to the wall: the way out is behind, and the robot does not turn first."""
    world, mind = mind_in(room(5.0, 4.0), Pose2(0.24, 2.0, math.pi))
    mind.look()
    mind.tick((2.5, 2.0))
    assert mind.path is not None
    assert mind.path.escape_m > 0.0
    for _ in range(8):
        mind.tick((2.5, 2.0))
    assert world.pose.x_m > 0.25
    assert abs(math.cos(world.pose.yaw_rad) + 1.0) < 0.1
    assert mind.drive((2.5, 2.0), 30.0)
    assert world.least_clearance_m > 0.06


def test_it_brakes_for_the_end_of_its_path():
    """In the open nothing else slows it down; what it arrives with, it stops from within the last 8 cm."""
    world, mind = mind_in(room(8.0, 4.0), Pose2(1.0, 2.0, 0.0))
    path = straight(mind, (1.0, 2.0), (5.0, 2.0))
    steering, fastest_mps = follow(mind, path), 0.0
    while not steering.arrived:
        world.step(steering.twist)
        fastest_mps = max(fastest_mps, world.twist.linear_mps)
        steering = follow(mind, path)
        assert world.time_s < 20.0
    assert fastest_mps > 0.45
    assert world.twist.linear_mps < 0.35


def test_it_turns_in_place_when_the_path_begins_behind_it():
    world, mind = mind_in(room(6.0, 4.0), Pose2(2.0, 2.0, math.pi))
    mind.look()
    for _ in range(12):
        mind.tick((5.0, 2.0))
    assert world.pose.distance_to(Pose2(2.0, 2.0, 0.0)) < 0.05
    assert mind.drive((5.0, 2.0), 20.0)


def test_spurious_returns_neither_stop_nor_steer_it():
    """Lone short returns straight ahead in every scan, of which the map knows nothing."""
    world, mind = mind_in(room(10.0, 4.0), Pose2(1.0, 2.0, 0.0), noise_scale=0.0)
    mind.look()
    path = straight(mind, (1.0, 2.0), (8.0, 2.0))
    for _ in range(40):
        scan = world.scan()
        scan.ranges_m[180 + (world.rng.integers(-2, 3))] = 0.4
        steering = mind.follower.follow(
            path,
            mind.map_from_robot,
            world.twist,
            scan,
            Pose2.identity(),
            mind.grid,
            mind.clearance.distance_m,
        )
        world.step(steering.twist)
    assert world.travelled_m > 1.7


def test_a_path_of_one_point_has_been_driven():
    _, mind = mind_in(room(4.0, 4.0), Pose2(2.0, 2.0, 0.0))
    mind.see()
    x, y = mind.map_from_robot.position
    steering = follow(mind, Path.through(np.array([[x, y]])))
    assert steering.arrived
    assert steering.twist == Twist2.zero()


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="max_speed_mps must be positive, got 0"):
        Body(max_speed_mps=0.0)
    with pytest.raises(ValueError, match="slow_speed_mps must be positive, got 0"):
        FollowerConfig(slow_speed_mps=0.0)
    with pytest.raises(ValueError, match="nearest_aim_m"):
        FollowerConfig(nearest_aim_m=1.0)
