"""Trajectories come back from TUM files as they went in; other files are refused."""

from pathlib import Path

import numpy as np
import pytest

from experiments.tum_file import Trajectory, read_tum, tum, write_tum
from occmap.geometry import Pose2


def test_tum_lines_hold_time_position_and_quaternion():
    line = tum([1.5], np.array([[1.0, 2.0, np.pi / 2]]))
    t, x, y, z, qx, qy, qz, qw = map(float, line.split())
    assert (t, x, y, z, qx, qy) == (1.5, 1.0, 2.0, 0.0, 0.0, 0.0)
    assert (qz, qw) == pytest.approx((np.sqrt(0.5), np.sqrt(0.5)))


def test_written_and_read_back_is_the_same(tmp_path: Path):
    poses = [Pose2(1.25, -3.5, 3.1), Pose2(0.0, 0.0, -3.1), Pose2(7.0, 7.0, 0.0)]
    write_tum(tmp_path / "a.tum", Trajectory.of([976052857.337284, 976052858.0, 976052859.123456], poses))
    read = read_tum(tmp_path / "a.tum")
    np.testing.assert_array_equal(read.times_s, [976052857.337284, 976052858.0, 976052859.123456])
    np.testing.assert_allclose(read.poses, [(p.x_m, p.y_m, p.yaw_rad) for p in poses], atol=1e-9)


def test_stamps_in_any_order_make_a_trajectory_in_order():
    trajectory = Trajectory.of([2.0, 1.0], [Pose2(0.2, 0.0, 0.0), Pose2(0.1, 0.0, 0.0)])
    np.testing.assert_array_equal(trajectory.times_s, [1.0, 2.0])
    np.testing.assert_array_equal(trajectory.poses[:, 0], [0.1, 0.2])


@pytest.mark.parametrize(
    "text", ["", "1 2 3\n", "1 2 3 4 5 6 7 eight\n", "nan 0 0 0 0 0 0 1\n", "1 2 3 4 0 0 0 0\n"]
)
def test_what_is_no_trajectory_is_refused(tmp_path: Path, text: str):
    (tmp_path / "a.tum").write_text(text)
    with pytest.raises(ValueError, match="is no TUM trajectory"):
        read_tum(tmp_path / "a.tum")
