"""Stuck or not, told from what the robot senses: each case as it happens."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from occmap.geometry import Pose2, Twist2
from occmap.scan import Observation
from occmap.stuck import StuckConfig, StuckDetector
from tests.occmap.kinematic_world import PERIOD_S, KinematicWorld, room

AHEAD, TURN, LOOK = Twist2(0.4, 0.0), Twist2(0.0, 1.0), Twist2(0.0, 0.1)
STUDY = room(6.0, 4.0, (2.0, 3.0, 2.6, 4.0), (4.5, 0.0, 5.0, 1.0))
CORRIDOR = np.array([(-60.0, -0.1, 60.0, 0.0), (-60.0, 2.0, 60.0, 2.1)])
START = Pose2(1.0, 1.5, 0.2)
ROUND = np.array(
    [(3 * math.cos(a) - 0.1, 3 * math.sin(a) - 0.1, 3 * math.cos(a) + 0.1, 3 * math.sin(a) + 0.1)
     for a in np.linspace(0, 2 * math.pi, 180, endpoint=False)]
)  # fmt: skip


class Ride:
    """A robot that is told to move, and moves as far as its wheels and the floor let it."""

    def __init__(self, boxes, start=START, noise_scale=1.0, seed=0):
        self.world = KinematicWorld(boxes, start, np.random.default_rng(seed), noise_scale)
        self.odometer = KinematicWorld(boxes, Pose2.identity(), np.random.default_rng(0), 0.0)
        self.detector = StuckDetector()

    def seen(self):
        return Observation(self.world.time_s, self.odometer.pose, self.world.scan(), Pose2.identity())

    def is_stuck_after(self, seconds, command, *, wheels_turn=True, robot_moves=True):
        """The first verdict that it is stuck, or none."""
        for _ in range(round(seconds / PERIOD_S)):
            seen = self.seen()
            if self.detector.is_stuck(seen):
                return True
            self.detector.remember(seen, command)
            self.world.step(command if robot_moves else Twist2.zero())
            self.odometer.step(command if wheels_turn else Twist2.zero())
        return False


@pytest.mark.parametrize("command", [AHEAD, TURN, Twist2(-0.2, 0.0)])
def test_wheels_that_are_held_are_noticed_within_three_seconds(command):
    ride = Ride(STUDY)
    assert not ride.is_stuck_after(1.5, command)
    assert ride.is_stuck_after(3.0, command, wheels_turn=False, robot_moves=False)


@pytest.mark.parametrize("command", [AHEAD, TURN])
@pytest.mark.parametrize("seed", range(3))
def test_wheels_that_slip_are_noticed_by_the_view_that_stays(command, seed):
    assert Ride(STUDY, seed=seed).is_stuck_after(5.0, command, robot_moves=False)


@pytest.mark.parametrize("command", [AHEAD, TURN, Twist2(0.3, 0.8)])
def test_a_robot_that_moves_is_not_stuck(command):
    assert not Ride(room(9.0, 3.0), Pose2(1.0, 1.5, 0.0)).is_stuck_after(8.0, command)


def test_a_bare_corridor_is_not_stuck():
    """The view is the same all along, as it would be if the wheels slipped."""
    assert not Ride(CORRIDOR, Pose2(0.0, 1.0, 0.0)).is_stuck_after(20.0, AHEAD)


def test_a_bare_corridor_seen_by_a_turning_lidar_is_not_stuck_either():
    """Made one instant's, its scans begin on either side of pi."""
    ride = Ride(CORRIDOR, Pose2(0.0, 1.0, 0.0))
    scan = ride.world.scan
    turned = [1e-3, -1e-3]

    def turning(beams=360):
        turned.reverse()
        seen = scan(beams)
        bearings = seen.bearings_rad + turned[0]
        return replace(seen, bearings_rad=np.arctan2(np.sin(bearings), np.cos(bearings)))

    ride.world.scan = turning
    assert not ride.is_stuck_after(20.0, AHEAD)


def test_turning_in_a_round_room_is_not_stuck():
    assert not Ride(ROUND, Pose2(0.0, 0.0, 0.0)).is_stuck_after(10.0, TURN)


def test_standing_and_looking_around_is_not_stuck():
    ride = Ride(STUDY)
    assert not ride.is_stuck_after(6.0, Twist2.zero())
    assert not ride.is_stuck_after(6.0, LOOK, wheels_turn=False, robot_moves=False)


def test_odometry_that_jumps_says_nothing():
    ride = Ride(CORRIDOR, Pose2(0.0, 1.0, 0.0))
    for _ in range(5):
        assert not ride.is_stuck_after(2.5, AHEAD)
        ride.odometer.pose = ride.odometer.pose @ Pose2(3.0, 4.0, 1.5)


def test_a_scan_of_another_size_or_an_empty_one_says_nothing():
    ride = Ride(STUDY)
    assert not ride.is_stuck_after(2.0, AHEAD, robot_moves=False)
    seen = ride.seen()
    fewer = replace(seen, scan=ride.world.scan(beams=180))
    nothing = replace(seen.scan, ranges_m=np.full(360, np.inf))
    assert not ride.detector.is_stuck(fewer)
    assert not ride.detector.is_stuck(replace(seen, scan=nothing))
    assert ride.detector.is_stuck(seen)


@pytest.mark.parametrize("beams", [0, 1, 2])
def test_a_beam_or_two_are_no_view(beams: int):
    ride = Ride(STUDY)
    whole = ride.seen

    def few():
        seen = whole()
        first = replace(
            seen.scan, bearings_rad=seen.scan.bearings_rad[:beams], ranges_m=seen.scan.ranges_m[:beams]
        )
        return replace(seen, scan=first)

    ride.seen = few
    assert not ride.is_stuck_after(6.0, AHEAD, robot_moves=False)


def test_after_a_reset_it_watches_a_whole_window_first():
    ride = Ride(STUDY)
    assert ride.is_stuck_after(3.0, AHEAD, wheels_turn=False, robot_moves=False)
    assert ride.detector.last_twist == AHEAD
    ride.detector.reset()
    assert ride.detector.last_twist == Twist2.zero()
    window = StuckConfig().window_s
    assert not ride.is_stuck_after(window - 0.1, AHEAD, wheels_turn=False, robot_moves=False)
    assert ride.is_stuck_after(0.5, AHEAD, wheels_turn=False, robot_moves=False)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="window_s must be positive"):
        StuckConfig(window_s=0.0)
    with pytest.raises(ValueError, match="still_m must be positive"):
        StuckConfig(still_m=math.nan)
