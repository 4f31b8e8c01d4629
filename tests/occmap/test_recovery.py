"""Manoeuvres that free the robot, how many there are, and when they are forgiven."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from occmap.body import Body
from occmap.geometry import Pose2, Twist2
from occmap.mobility import Mobility
from occmap.recovery import Recovery, RecoveryConfig
from occmap.scan import Observation, Scan
from tests.occmap.kinematic_world import PERIOD_S, KinematicWorld, room

AHEAD = Twist2(0.3, 0.0)
CIRCLE = Twist2(0.3, 0.4)
BEARINGS = np.linspace(-math.pi, math.pi, 72, endpoint=False)


def seen_at(time_s, *, behind_m=5.0, ahead_m=5.0, x_m=0.0, robot_from_lidar=None):
    """Walls ahead and behind, as one cone of beams each."""
    off_rad = np.abs(BEARINGS)
    ranges = np.where(off_rad < 0.6, ahead_m, np.where(off_rad > math.pi - 0.6, behind_m, 4.0))
    scan = Scan(BEARINGS, ranges, max_range_m=12.0)
    return Observation(time_s, Pose2(x_m, 0.0, 0.0), scan, robot_from_lidar or Pose2.identity())


def unasked(ahead_m):
    raise AssertionError("the lidar sees enough: nobody need ask the map")


def manoeuvre(recovery, begun_s, **walls):
    """The twists of one manoeuvre, ten a second, to its end."""
    twists = []
    while (twist := recovery.twist(seen_at(begun_s + 0.1 * len(twists), **walls), unasked)) is not None:
        twists.append(twist)
        assert len(twists) < 200
    return twists


def begun(commanded=AHEAD, now_s=7.0, attempts=1, body=None):
    recovery = Recovery(body=body)
    for _ in range(attempts):
        recovery.begin(seen_at(now_s), commanded)
    return recovery


def test_it_backs_off_and_then_turns():
    twists = manoeuvre(begun(), 7.0)
    assert twists == 15 * [Twist2(-0.15, 0.0)] + 15 * [Twist2(0.0, 0.8)]


def test_what_got_stuck_backwards_goes_ahead():
    assert manoeuvre(begun(Twist2(-0.1, 0.0)), 7.0)[0] == Twist2(0.15, 0.0)


def test_each_turn_is_to_the_other_side_and_manoeuvres_grow_longer():
    manoeuvres = [manoeuvre(begun(attempts=k), 7.0) for k in range(1, 7)]
    assert [math.copysign(1, twists[-1].angular_radps) for twists in manoeuvres] == [1, -1, 1, -1, 1, -1]
    lengths = [len(twists) for twists in manoeuvres]
    assert lengths == sorted(lengths)
    assert lengths[-1] > 2 * lengths[0]


def test_it_drives_only_while_there_is_room():
    recovery = begun()
    assert recovery.twist(seen_at(7.0, behind_m=0.4), unasked).linear_mps < 0.0
    assert recovery.twist(seen_at(7.3, behind_m=0.27), unasked) == Twist2(0.0, 0.8)  # the wall has come near
    assert begun(Twist2(-0.1, 0.0)).twist(seen_at(7.0, ahead_m=0.2), unasked) == Twist2(0.0, 0.8)


def test_a_larger_body_needs_more_room_and_a_slower_one_is_slower():
    recovery = begun(body=Body(radius_m=0.5, max_speed_mps=0.1))
    assert recovery.twist(seen_at(7.0, behind_m=0.65), unasked) == Twist2(-0.1, 0.0)
    assert recovery.twist(seen_at(7.0, behind_m=0.6), unasked) == Twist2(0.0, 0.8)


def test_where_the_lidar_does_not_look_the_map_is_asked():
    seen = seen_at(7.0)
    ahead_only = replace(
        seen, scan=replace(seen.scan, ranges_m=np.where(np.abs(BEARINGS) < 1.6, 3.0, np.nan))
    )
    assert begun().twist(ahead_only, lambda ahead_m: 1.0).linear_mps < 0.0
    assert begun().twist(ahead_only, lambda ahead_m: 0.3 if ahead_m == 0.0 else 0.2) == Twist2(0.0, 0.8)
    assert begun().twist(ahead_only, lambda ahead_m: 0.2).linear_mps < 0.0  # it gets no worse


def test_room_is_seen_from_the_robot_wherever_its_lidar_sits():
    backwards = Pose2(0.0, 0.0, math.pi)
    recovery = begun()
    assert recovery.twist(seen_at(7.0, ahead_m=0.2, robot_from_lidar=backwards), unasked).linear_mps == 0.0
    assert recovery.twist(seen_at(7.0, behind_m=0.2, robot_from_lidar=backwards), unasked).linear_mps < 0.0


def test_without_a_manoeuvre_there_is_no_twist():
    recovery = Recovery()
    assert recovery.twist(seen_at(0.0), unasked) is None
    assert not recovery.is_exhausted


@pytest.mark.parametrize("field", ["attempts", "speed_mps", "leg_s", "forgive_after_s"])
def test_nonsense_is_refused(field):
    with pytest.raises(ValueError, match=field):
        RecoveryConfig(**{field: 0})


class Driver:
    """Tells a robot in a room to drive in a circle; it does, or it is held."""

    def __init__(self, **config):
        self.mobility = Mobility(recovery=RecoveryConfig(**config))
        self.world = KinematicWorld(room(6.0, 5.0), Pose2(3.0, 2.0, 0.0), np.random.default_rng(0))

    def drive(self, seconds, *, held=False, command=CIRCLE):
        for _ in range(round(seconds / PERIOD_S)):
            world = self.world
            seen = Observation(world.time_s, world.pose, world.scan(beams=120), Pose2.identity())
            twist = self.mobility.manoeuvre(seen, unasked) or command
            self.mobility.remember(seen, twist)
            world.step(Twist2.zero() if held else twist)


def test_the_robots_own_motion_is_what_odometry_says():
    mobility = Mobility()
    assert mobility.measured_twist(seen_at(0.0)) == Twist2.zero()
    mobility.remember(seen_at(0.0), AHEAD)
    assert mobility.measured_twist(seen_at(0.1, x_m=0.02)).linear_mps == pytest.approx(0.2)
    assert mobility.measured_twist(seen_at(0.0, x_m=0.02)) == Twist2.zero()  # no time has passed


def test_a_robot_that_is_held_for_good_is_hopeless_after_its_attempts():
    driver = Driver(attempts=3)
    driver.drive(8.0, held=True)
    assert 1 <= driver.mobility.attempts < 3
    assert not driver.mobility.is_hopeless
    driver.drive(30.0, held=True)
    assert driver.mobility.is_hopeless
    assert driver.mobility.attempts == 3


def test_incidents_far_apart_are_forgiven():
    driver = Driver(attempts=2, forgive_after_s=15.0)
    for _ in range(5):
        driver.drive(3.0, held=True)
        assert driver.mobility.attempts == 1
        driver.drive(25.0)
        assert driver.mobility.attempts == 0
    assert not driver.mobility.is_hopeless


def test_incidents_close_together_are_not():
    driver = Driver(attempts=2, forgive_after_s=15.0)
    for _ in range(3):
        driver.drive(3.0, held=True)
        driver.drive(10.0)
    assert driver.mobility.is_hopeless


def test_standing_still_forgives_nothing():
    driver = Driver()
    driver.drive(3.0, held=True)
    driver.drive(60.0, command=Twist2.zero())
    assert driver.mobility.attempts == 1
