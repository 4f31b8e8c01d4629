"""Wheels that claim too much in every step are found out, and believed the less in corridors."""

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization.wheel_scale import WheelScale, WheelScaleConfig
from tests.occmap.kinematic_world import room
from tests.occmap.localization.drives import drive, mapped, observe


def driven(scale, metres, rng, step_m=0.05, sigma_m=0.005, direction=1.0):
    """Learnt from poses, each seen with an error of its own, where a metre claimed is `scale` metres."""
    places = np.arange(0.0, metres, step_m)
    seen = np.diff(places + rng.normal(0.0, sigma_m, len(places)))
    learnt = WheelScale(WheelScaleConfig())
    for gone in seen.tolist():
        learnt.learn(direction * step_m / scale, direction * gone)
    return learnt


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("scale", [0.97, 1.0, 1.03])
def test_a_scale_is_learnt_to_a_thousandth_forward_or_backward(scale, direction):
    learnt = driven(scale, 2000.0, np.random.default_rng(0), direction=direction)
    doubt = 20.0 / (20.0 + 200.0)
    assert learnt.factor == pytest.approx(1.0 + (1.0 - doubt) * (scale - 1.0), abs=1e-3)


def test_wheels_are_believed_until_enough_was_seen():
    assert WheelScale(WheelScaleConfig()).factor == 1.0
    assert driven(0.9, 20.0, np.random.default_rng(1)).factor == pytest.approx(0.95, abs=0.01)


def test_a_slip_is_no_scale():
    learnt = WheelScale(WheelScaleConfig())
    for claimed_m, gone_m in ((0.1, 0.01), (0.1, -0.1), (0.01, 0.005)):
        learnt.learn(claimed_m, gone_m)
    assert learnt.factor == 1.0


def test_no_scale_is_absurd():
    assert driven(0.6, 500.0, np.random.default_rng(2)).factor == pytest.approx(0.9)


def test_a_step_is_corrected_in_its_length_not_in_its_turn():
    learnt = driven(0.95, 500.0, np.random.default_rng(3))
    step = learnt.corrected(Pose2(1.0, 0.1, 0.3))
    assert step.x_m == pytest.approx(0.955, abs=0.005)
    assert (step.y_m, step.yaw_rad) == (pytest.approx(0.1 * step.x_m), 0.3)


def test_what_a_room_taught_of_the_wheels_holds_in_a_bare_corridor():
    """Laps of a room, then a corridor without an end in sight: nothing there says that the wheels lie."""
    low, high, end = 0.9, 2.1, 80.0
    inside = room(8.0, 8.0, (3, 3, 5, 5), (0.5, 4, 0.9, 4.4))
    doorway = [
        (8.0, -0.1, 8.1, low),
        (8.0, high, 8.1, 8.1),
        (8, low - 0.1, end, low),
        (8, high, end, high + 0.1),
    ]
    boxes = np.vstack((inside[:3], inside[4:], doorway))
    laps = [(1.5, 1.5), (6.5, 1.5), (6.5, 6.5), (1.5, 6.5)] * 2
    poses = drive([*laps, (1.5, 1.5), (40.0, 1.5)])
    rng = np.random.default_rng(4)
    stream = observe(boxes, poses, rng, turn_error_per_m=0.0, length_error=0.04, max_range_m=8.0)
    track = [pose for _, pose in mapped(stream).trajectory()]
    bare = next(k for k, pose in enumerate(poses) if pose.x_m > 18.0)  # the door is out of sight
    driven_m, mapped_m = (math.dist(way[bare].position, way[-1].position) for way in (poses, track))
    assert mapped_m == pytest.approx(driven_m, rel=0.02)
