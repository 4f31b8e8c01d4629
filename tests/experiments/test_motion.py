"""How a robot moved, told from drawn paths."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from experiments.motion import Drive, DriveLog, bends_rad, motion
from tests.occmap.goal_scenes import goal_at


def walked(*corners, step_m=0.05):
    """(n, 3) poses along a polyline, looking where it goes."""
    poses = []
    for (x0, y0), (x1, y1) in pairwise(corners):
        n = round(math.hypot(x1 - x0, y1 - y0) / step_m)
        share = np.arange(n + 1) / n
        yaw = np.full(n + 1, math.atan2(y1 - y0, x1 - x0))
        poses.append(np.column_stack((x0 + share * (x1 - x0), y0 + share * (y1 - y0), yaw)))
    return np.vstack(poses)


def test_a_way_there_and_back_is_one_reversal_and_half_a_turn():
    figures = motion(walked((0, 0), (5, 0), (0, 0)), [], 10.0, 40.0)
    assert figures["reversals"] == 1
    assert figures["turning_rad"] == pytest.approx(math.pi)
    assert figures["mean_speed_mps"] == 0.25


def test_a_corner_is_no_reversal():
    figures = motion(walked((0, 0), (5, 0), (5, 5), (0, 5)), [], 15.0, 30.0)
    assert figures["reversals"] == 0
    assert figures["turning_rad"] == pytest.approx(math.pi)


def test_bends_are_told_metre_by_metre():
    bends = bends_rad(walked((0, 0), (3.2, 0), (3.2, 3))[:, :2])
    assert abs(bends).sum() == pytest.approx(math.pi / 2, abs=0.05)
    assert len(bends) == 5
    assert len(bends_rad(np.zeros((4, 2)))) == 0


def test_who_stands_still_has_no_figures_to_divide_by():
    figures = motion(np.zeros((3, 3)), [], 0.0, 0.0)
    assert set(figures.values()) == {0}


def test_long_drives_cross_the_map_and_metres_to_goals_left_behind_are_in_vain():
    drives = [Drive(6.0, False), Drive(2.0, True), Drive(4.0, False)]
    figures = motion(walked((0, 0), (10, 0), (8, 0)), drives, 12.0, 24.0)
    assert figures["crossings"] == 1
    assert figures["abandoned_share"] == pytest.approx(2.0 / 12.0)


def seen(driven_m, goal, switches=0):
    """What a DriveLog reads of a step: metres so far, the goal, and how many were left for others."""
    return SimpleNamespace(
        truth=SimpleNamespace(path_length_m=driven_m),
        decision=SimpleNamespace(goal=goal, goal_switches=switches),
    )


def test_a_drive_ends_with_its_goal():
    log = DriveLog()
    log.record(seen(0.0, None))
    log.record(seen(1.0, goal_at(5.0, 0.0)))
    log.record(seen(2.0, goal_at(5.3, 0.0)))  # the same frontier, seen better
    log.record(seen(4.0, goal_at(0.0, 9.0), switches=1))  # left for another
    log.record(seen(7.0, None, switches=1))  # seen
    assert log.drives == [Drive(3.0, True), Drive(3.0, False)]
