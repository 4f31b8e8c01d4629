"""Wheels that lie, scans that are missing, and places found again after it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization.loop_candidates import uncertainty_from
from occmap.localization.motion import MotionConfig, MotionModel
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.scan import Observation, Scan
from tests.occmap.localization.drives import RING, RING_LAP, drive, errors_m, mapped, observe

BLANK = Scan(np.zeros(1), np.full(1, np.nan), 10.0)


def _seen(time_s, odom_from_robot):
    return Observation(time_s, odom_from_robot, BLANK, Pose2.identity())


def test_wheels_that_err_are_believed_less_and_trusted_again():
    motion, odom, honest = MotionModel(MotionConfig()), Pose2.identity(), Pose2(0.1, 0.0, 0.0)
    motion.predict(_seen(0.0, odom))
    sigmas = []
    for k in range(1, 201):
        odom = odom @ honest
        sigmas.append(motion.predict(_seen(0.2 * k, odom)).sigma_m)
        motion.took(Pose2(0.16, 0.0, 0.0) if k <= 60 else honest)
    assert sigmas[59] > 2.0 * sigmas[0]
    assert sigmas[-1] == pytest.approx(sigmas[0], rel=0.05)


def test_what_no_scan_has_confirmed_says_nothing_about_the_wheels():
    motion, odom = MotionModel(MotionConfig()), Pose2.identity()
    motion.predict(_seen(0.0, odom))
    for k in range(1, 60):
        odom = odom @ Pose2(0.1, 0.0, 0.0)
        motion.predict(_seen(0.2 * k, odom))
        motion.took(Pose2(0.2, 0.0, 0.0), is_seen=False)
    sigma_m = motion.predict(_seen(12.0, odom @ Pose2(0.1, 0.0, 0.0))).sigma_m
    assert sigma_m == pytest.approx(MotionConfig().sigma_m + 0.1 * MotionConfig().sigma_m_per_m)


def test_odometry_that_begins_anew_is_no_leap_of_the_robot():
    motion, step = MotionModel(MotionConfig()), Pose2(0.1, 0.0, 0.0)
    motion.predict(_seen(0.0, Pose2(7.0, 3.0, 1.0)))
    motion.predict(_seen(0.2, Pose2(7.0, 3.0, 1.0) @ step))
    motion.took(step)
    assert motion.predict(_seen(0.4, Pose2.identity())).step == step


def test_after_a_pause_all_of_the_way_is_uncertain():
    motion = MotionModel(MotionConfig())
    motion.predict(_seen(0.0, Pose2.identity()))
    prediction = motion.predict(_seen(60.0, Pose2(0.5, 0.0, 0.0)))
    assert prediction.is_gap
    assert prediction.sigma_m > 1.0
    assert not motion.predict(_seen(60.2, Pose2(0.6, 0.0, 0.0))).is_gap


def test_a_robot_that_stood_through_a_pause_is_where_it_was():
    motion = MotionModel(MotionConfig())
    for k in range(3):
        motion.predict(_seen(0.2 * k, Pose2(0.1 * k, 0.0, 0.0)))
    assert not motion.predict(_seen(600.0, Pose2(0.2, 0.0, 0.0))).is_gap


@pytest.mark.parametrize("step", [Pose2(0.1, 0.0, 0.0), Pose2.identity()], ids=["wheels", "no odometry"])
def test_a_robot_that_rested_overnight_is_where_it_was(step):
    """What its wheels say of it is believed as on the day before."""
    motion, odom = MotionModel(MotionConfig()), Pose2.identity()
    for k in range(3):
        odom = odom @ step
        usual = motion.predict(_seen(0.2 * k, odom))
        motion.took(Pose2(0.1, 0.0, 0.0))
    motion.rest_until(40_000.0)
    after = motion.predict(_seen(40_000.0, odom @ step))
    assert after.step.x_m == pytest.approx(step.x_m)
    assert (after.sigma_m, after.sigma_rad) == pytest.approx((usual.sigma_m, usual.sigma_rad))
    assert not after.is_gap


def test_no_robot_has_come_farther_since_the_last_scan_that_fitted_than_robots_go():
    motion, c = MotionModel(MotionConfig()), MotionConfig()
    motion.predict(_seen(0.0, Pose2.identity()))
    most_m = []
    for k in range(1, 5):
        most_m.append(motion.predict(_seen(0.2 * k, Pose2(0.1 * k, 0.0, 0.0))).most_m)
        motion.took(Pose2(0.1, 0.0, 0.0), is_seen=False, fits=k == 3)
    assert most_m == pytest.approx([0.2 * c.leap_mps, 0.4 * c.leap_mps, 0.6 * c.leap_mps, 0.2 * c.leap_mps])


@pytest.mark.parametrize("seed", [2, 3])
def test_a_robot_that_stands_between_bare_walls_stays_where_it_is(seed):
    """Its wheels have never moved. Noise says as much of the corridor's length as the scans do: nothing."""
    corridor = np.array([(-30, 1.1, 30, 1.3), (-30, -1.3, 30, -1.1)], float)
    stands = [Pose2(0.0, 0.0, 0.3)] * 60
    slam = mapped(observe(corridor, stands, np.random.default_rng(seed), noise_scale=1.0))
    assert errors_m(stands, [pose for _, pose in slam.trajectory()]).max() < 0.01


def test_odometry_that_stands_while_scans_move_is_none():
    motion, step = MotionModel(MotionConfig()), Pose2(0.1, 0.0, 0.0)
    motion.predict(_seen(0.0, Pose2.identity()))
    standing = motion.predict(_seen(0.2, Pose2.identity()))
    motion.took(step)
    moving = motion.predict(_seen(0.4, Pose2.identity()))
    assert standing.step == Pose2.identity()
    assert moving.step == step
    assert moving.sigma_m > 3.0 * standing.sigma_m
    assert moving.window_m == standing.window_m


@pytest.mark.parametrize("turn_rad", [0.15, 0.95])
def test_scans_missing_on_the_way_are_bridged_by_a_loop(turn_rad):
    """Of three laps a third of the second is missing, and the wheels err by a metre and a turn meanwhile."""
    poses = drive([*RING_LAP * 3, RING_LAP[0]])
    stream = observe(RING, poses, np.random.default_rng(0))
    from_k, to_k = len(poses) // 3, len(poses) // 3 + len(poses) // 9
    wrong = Pose2(0.8, -0.6, turn_rad)
    turned_at = stream[to_k].odom_from_robot
    kept = stream[:from_k] + [
        replace(seen, odom_from_robot=turned_at @ wrong @ turned_at.inverse() @ seen.odom_from_robot)
        for seen in stream[to_k:]
    ]
    slam = mapped(kept)
    assert sum(submap.is_after_gap for submap in slam.tracker.submaps) == 1
    driven = poses[:from_k] + poses[to_k:]
    assert errors_m(driven, [pose for _, pose in slam.trajectory()]).max() < 0.2


def test_what_is_driven_blind_leaves_the_heading_as_uncertain_as_the_wheels():
    """A hall wider than the laser reaches: there is no map that could pull the next scan back."""
    stream = observe(RING, drive(RING_LAP[:2]), np.random.default_rng(0))
    blind = [replace(seen, scan=replace(seen.scan, ranges_m=np.full(180, np.nan))) for seen in stream[5:]]
    seeing_rad, blind_rad = (
        math.sqrt(uncertainty_from(slam.graph, len(slam.graph.poses) - 1)[1][0])
        for slam in (mapped(stream), mapped(stream[:5] + blind))
    )
    assert seeing_rad < 0.01
    assert blind_rad > 0.03


def test_a_tight_loop_convinces_a_loose_chain_however_far_off_it_begins():
    """Ten steps, one of them hardly known, and off by metres: dynamic covariance scaling alone gives up."""
    tight, loose = np.diag([1e4, 1e4, 1e6]), np.diag([0.1, 0.1, 10.0])
    step, wrong = Pose2(1.0, 0.0, 0.0), Pose2(3.0, 2.0, 0.3)
    graph = PoseGraph()
    graph.add_node(Pose2.identity())
    for k in range(1, 11):
        measured = wrong if k == 5 else step
        graph.add_node(graph.pose(k - 1) @ measured)
        graph.add_edge(k - 1, k, measured, loose if k == 5 else tight)
    for older, younger in ((1, 8), (2, 9)):
        apart = Pose2(7.0, 0.0, 0.0)
        graph.add_edge(older, younger, apart, tight, Loss.DCS, 6.0, is_graduated=True)
    graph.optimise()
    assert math.hypot(*(graph.poses[10, :2] - (10.0, 0.0))) < 0.05
    assert graph.weights()[-2:].min() > 0.9


def test_a_lone_wrong_loop_does_not_convince_a_tight_chain():
    tight = np.diag([1e4, 1e4, 1e6])
    graph = PoseGraph()
    graph.add_node(Pose2.identity())
    for k in range(1, 11):
        graph.add_node(Pose2(float(k), 0.0, 0.0))
        graph.add_edge(k - 1, k, Pose2(1.0, 0.0, 0.0), tight)
        if k > 3:
            graph.add_edge(k - 3, k, Pose2(3.0, 0.0, 0.0), tight, Loss.DCS, 6.0, is_graduated=True)
    graph.add_edge(1, 9, Pose2(2.0, -1.0, 1.0), tight, Loss.DCS, 6.0, is_graduated=True)
    graph.optimise()
    assert np.abs(graph.poses[:, :2] - np.column_stack((np.arange(11.0), np.zeros(11)))).max() < 0.05
    assert graph.weights()[-1] < 0.01
