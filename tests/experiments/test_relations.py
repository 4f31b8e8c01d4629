"""The relations metric on trajectories whose error is known."""

from pathlib import Path

import numpy as np
import pytest

from experiments.planar import between
from experiments.relations import Relations, read_relations, score_relations
from experiments.tum_file import Trajectory
from occmap.geometry import Pose2


def wandering(rng: np.random.Generator, n: int = 60) -> Trajectory:
    poses = [Pose2.identity()]
    for _ in range(n - 1):
        poses.append(poses[-1] @ Pose2(*rng.normal(0.0, (0.5, 0.2, 0.7))))
    return Trajectory.of([1000.0 + 0.25 * k for k in range(n)], poses)


def relations_of(truth: Trajectory, rng: np.random.Generator, n: int = 40) -> Relations:
    begin, end = rng.integers(0, len(truth), (2, n))
    deltas = between(truth.poses[begin], truth.poses[end])
    return Relations(truth.times_s[begin], truth.times_s[end], deltas)


def test_the_truth_has_no_error_wherever_its_frame_lies():
    rng = np.random.default_rng(0)
    truth = wandering(rng)
    relations = relations_of(truth, rng)
    elsewhere = [Pose2(5.0, -3.0, 2.0) @ Pose2(*row) for row in truth.poses.tolist()]
    for laser in (truth, Trajectory.of(truth.times_s.tolist(), elsewhere)):
        score = score_relations(laser, relations)
        assert score.relations == 40
        assert score.translation_m.max < 1e-9
        assert score.rotation_deg.max < 1e-9


def test_the_error_is_delta_ref_inverse_times_the_estimated_relation():
    rng = np.random.default_rng(1)
    truth, laser = wandering(rng), wandering(rng)
    relations = relations_of(truth, rng)
    score = score_relations(laser, relations)
    metres, degrees = [], []
    for t1, t2, delta in zip(relations.begin_s, relations.end_s, relations.deltas.tolist(), strict=True):
        a, b = (Pose2(*laser.poses[np.flatnonzero(laser.times_s == t)[0]].tolist()) for t in (t1, t2))
        error = Pose2(*delta).inverse() @ (a.inverse() @ b)
        metres.append(np.hypot(error.x_m, error.y_m))
        degrees.append(np.degrees(abs(error.yaw_rad)))
    assert score.translation_m.mean == pytest.approx(np.mean(metres))
    assert score.translation_m.std == pytest.approx(np.std(metres))
    assert score.translation_m.max == pytest.approx(np.max(metres))
    assert score.translation_squared_m2.mean == pytest.approx(np.mean(np.square(metres)))
    assert score.rotation_deg.mean == pytest.approx(np.mean(degrees))
    assert score.rotation_squared_deg2.max == pytest.approx(np.max(degrees) ** 2)


def test_relations_whose_stamps_the_trajectory_lacks_are_counted():
    rng = np.random.default_rng(2)
    truth = wandering(rng)
    relations = relations_of(truth, rng)
    half = Trajectory(truth.times_s[:30], truth.poses[:30])
    score = score_relations(half, relations)
    assert score.missing > 0
    assert score.relations + score.missing == 40
    with pytest.raises(ValueError, match="none of the stamps"):
        score_relations(Trajectory(truth.times_s + 1e3, truth.poses), relations)


def test_a_file_holds_x_y_z_roll_pitch_yaw(tmp_path: Path):
    path = tmp_path / "some.relations"
    path.write_text("# t1 t2 x y z roll pitch yaw\n10.5 11.25 1 2 0 0 0 0.5\n")
    relations = read_relations(path)
    assert (relations.begin_s[0], relations.end_s[0]) == (10.5, 11.25)
    np.testing.assert_array_equal(relations.deltas, [(1.0, 2.0, 0.5)])


@pytest.mark.parametrize("text", ["", "1 2 3\n", "1 2 3 4 5 6 7 eight\n"])
def test_what_holds_no_relations_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "some.relations"
    path.write_text(text)
    with pytest.raises(ValueError, match="is no file of relations"):
        read_relations(path)
    with pytest.raises(ValueError, match="cannot read"):
        read_relations(tmp_path / "none")
