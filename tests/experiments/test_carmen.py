"""CARMEN logs: what their lines mean, and that nothing in them is fatal."""

import bz2
import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from experiments.logs.carmen import read_carmen
from experiments.logs.log import read_log
from occmap.geometry import Pose2

TAIL = "robot 1.5"


def flaser(ranges: str, laser: str, odom: str, stamp: float) -> str:
    return f"FLASER {len(ranges.split())} {ranges} {laser} {odom} {stamp} {TAIL}\n"


def robotlaser(ranges: str, stamp: int, remissions: str = "") -> str:
    n, m = len(ranges.split()), len(remissions.split())
    head = f"ROBOTLASER1 0 -1.5 3.0 0.5 8.0 0.01 0 {n} {ranges} {m} {remissions}"
    return f"{head} {stamp}.1 2 0.5 {stamp} 2 0.5 0.3 0.1 0.2 0.2 1e6 {stamp} {TAIL}\n"


def rawlaser(ranges: str, stamp: float) -> str:
    head = f"RAWLASER1 0 -1.5 3.0 0.5 8.0 0.01 0 {len(ranges.split())} {ranges}"
    return f"{head} 2 7 7 {stamp} {TAIL}\n"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "some.log"
    path.write_text(text)
    return path


def test_flaser_holds_the_laser_s_pose_and_then_the_robot_s_odometry(tmp_path: Path):
    text = flaser("1 2 3 81.83", "1 2 0.1", "1 2 0.1", 5.0) + flaser(
        "4 5 6 50.0", "1.5 2 0.1", "1.5 2 0.1", 6.0
    )
    log = read_carmen(written(tmp_path, text))
    assert [seen.time_s for seen in log.observations] == [5.0, 6.0]
    assert log.observations[1].odom_from_robot == Pose2(1.5, 2.0, 0.1)
    assert log.observations[0].robot_from_lidar == Pose2.identity()
    np.testing.assert_array_equal(log.observations[0].scan.ranges_m, [1, 2, 3, np.inf])
    np.testing.assert_array_equal(log.observations[1].scan.is_hit, [True, True, True, False])
    assert log.has_odometry
    assert log.skipped == ()


@pytest.mark.parametrize("yaw_rad", [0.0, math.pi])
def test_the_laser_s_mount_is_what_both_poses_agree_on(tmp_path: Path, yaw_rad: float):
    """One that looks back is turned by six digits of pi: now a little beyond it, now not."""
    mount = Pose2(-0.04, 0.0, yaw_rad)
    lines = []
    for k in range(40):
        odom = Pose2(k, 0.5 * k, 0.8 * k)
        laser = odom @ mount
        text = [f"{p.x_m:.6f} {p.y_m:.6f} {p.yaw_rad:.6f}" for p in (laser, odom)]
        lines.append(flaser("1 2", text[0], text[1], float(k)))
    off = mount.inverse() @ read_carmen(written(tmp_path, "".join(lines))).observations[0].robot_from_lidar
    assert (off.x_m, off.y_m, off.yaw_rad) == pytest.approx((0.0, 0.0, 0.0), abs=2e-6)


def test_a_corrected_laser_pose_is_no_mount(tmp_path: Path):
    lines = [flaser("1 2", f"{0.7 * k} {0.2 * k} 0", f"{k} 0 0", float(k)) for k in range(4)]
    text = "PARAM robot_frontlaser_offset 0.2 0 host 0\n" + "".join(lines)
    assert read_carmen(written(tmp_path, text)).observations[0].robot_from_lidar == Pose2(0.2, 0.0, 0.0)


@pytest.mark.parametrize(
    ("beams", "first_deg", "last_deg"),
    [(180, -90, 89), (181, -90, 90), (360, -90, 89.5), (361, -90, 90), (401, -50, 50), (91, -90, 90)],
)
def test_flaser_bearings_follow_from_the_number_of_beams(
    tmp_path: Path, beams: int, first_deg: float, last_deg: float
):
    log = read_carmen(written(tmp_path, flaser("1 " * beams, "0 0 0", "0 0 0", 1.0)))
    bearings = np.degrees(log.observations[0].scan.bearings_rad)
    assert (bearings[0], bearings[-1]) == pytest.approx((first_deg, last_deg))


def test_robotlaser_says_its_own_field_of_view_and_its_beams_may_change(tmp_path: Path):
    text = robotlaser("1 2 8.0 3", 1, remissions="7 7") + robotlaser("1 2", 2)
    first, second = read_carmen(written(tmp_path, text)).observations
    np.testing.assert_allclose(first.scan.bearings_rad, [-1.5, -1.0, -0.5, 0.0])
    np.testing.assert_array_equal(first.scan.ranges_m, [1, 2, np.inf, 3])
    assert first.scan.max_range_m == 8.0
    assert len(second.scan.ranges_m) == 2
    assert first.robot_from_lidar.x_m == pytest.approx(0.1 * math.cos(0.5), abs=1e-6)
    assert first.odom_from_robot == Pose2(1.0, 2.0, 0.5)


def test_robotlaser_s_error_codes_are_no_returns(tmp_path: Path):
    text = robotlaser("1 81.83 81.91 80.9", 1).replace(" 8.0 ", " 81.92 ")
    ranges = read_carmen(written(tmp_path, text)).observations[0].scan.ranges_m
    np.testing.assert_array_equal(ranges, [1, np.inf, np.inf, 80.9])


@pytest.mark.parametrize("code", [8.19, 16.38, 32.0])
def test_a_longest_range_that_is_heaped_up_is_no_return(tmp_path: Path, code: float):
    """FLASER does not say what its sensor is set to. Minor codes just short of the main one are as bad."""
    rng = np.random.default_rng(0)
    ranges = code * np.sort(rng.uniform(0.05, 0.99, (100, 60)), axis=1)
    ranges[:, -20:] = code
    ranges[::10, -1] = code - 0.01
    rows = [" ".join(f"{r:.2f}" for r in row) for row in ranges]
    text = "".join(flaser(row, f"{k} 0 0", f"{k} 0 0", float(k)) for k, row in enumerate(rows))
    for seen in read_carmen(written(tmp_path, text)).observations:
        np.testing.assert_array_equal(seen.scan.is_hit, [True] * 40 + [False] * 20)
        assert np.all(np.isposinf(seen.scan.ranges_m[40:]))


def test_a_longest_range_that_was_measured_stays(tmp_path: Path):
    """The corner of a room in which a robot stood, without any noise."""
    away = np.abs(np.linspace(-1.5, 1.5, 61))
    ranges = np.minimum(6.0 / np.cos(np.minimum(away, 1.4)), 4.0 / np.maximum(np.sin(away), 0.1))
    row = " ".join(f"{r:.2f}" for r in ranges)
    text = "".join(flaser(row, "0 0 0", "0 0 0", float(k)) for k in range(1000))
    assert all(seen.scan.is_hit.all() for seen in read_carmen(written(tmp_path, text)).observations)


def test_a_step_that_does_not_fit_the_number_of_beams_is_not_believed(tmp_path: Path):
    bearings = read_carmen(written(tmp_path, robotlaser("1 " * 13, 1))).observations[0].scan.bearings_rad
    assert (bearings[0], bearings[-1]) == pytest.approx((-1.5, 1.5))


def test_of_scans_written_twice_one_kind_is_read(tmp_path: Path):
    text = "".join(robotlaser("1 2", t) + flaser("1 2 3", "0 0 0", "0 0 0", t) for t in (1, 2))
    assert [len(seen.scan.ranges_m) for seen in read_carmen(written(tmp_path, text)).observations] == [2, 2]


def test_scans_are_sorted_by_their_own_stamps(tmp_path: Path):
    text = "".join(flaser("1 2", f"{t} 0 0", f"{t} 0 0", t) for t in (3.0, 1.0, 2.0))
    log = read_carmen(written(tmp_path, text))
    assert [seen.time_s for seen in log.observations] == [1.0, 2.0, 3.0]
    assert [seen.odom_from_robot.x_m for seen in log.observations] == [1.0, 2.0, 3.0]
    assert log.duration_s == 2.0


@pytest.mark.parametrize("with_odometry", [True, False])
def test_stamps_that_make_the_robot_jump_are_not_believed(tmp_path: Path, with_odometry: bool):
    """As in the log of the Intel Research Lab: the file has the scans as they were taken."""
    stamps = [0.0, 1.0, 3.0, 2.0, 5.0, 4.0, 6.0]
    lines = []
    for k, stamp in enumerate(stamps):
        pose = f"{0.5 * k if with_odometry else 0} 0 0"
        lines.append(flaser(f"{5 - 0.5 * k} {1 + 0.5 * k}", pose, pose, stamp))
    log = read_carmen(written(tmp_path, "".join(lines)))
    assert [seen.time_s for seen in log.observations] == stamps
    assert log.duration_s == 6.0


def test_broken_lines_are_counted_by_their_number_and_never_fatal(tmp_path: Path):
    good = flaser("1 2", "0 0 0", "0 0 0", 1.0)
    broken = [
        "FLASER 3 1 2 0 0 0 0 0 0\n",  # cut short
        "FLASER two 1 2 0 0 0 0 0 0 1.0 host 1\n",
        "FLASER 2 1 x 0 0 0 0 0 0 1.0 host 1\n",
        "FLASER 2 1 2 0 0 nan 0 0 0 1.0 host 1\n",
        "FLASER 0 0 0 0 0 0 0 1.0 host 1\n",
        "ROBOTLASER1 0 -1.5\n",
        "ODOM 1 2\n",
        "\x00\x07binary\n",
    ]
    fine = ["# a comment\n", "\n", "PARAM a b 0 host 0\n", "SYNC tag 1 host 1\n", "NMEA-GGA 1 2 3\n"]
    log = read_carmen(written(tmp_path, good + "".join(broken) + "".join(fine) + good))
    assert [skipped.number for skipped in log.skipped] == list(range(2, 2 + len(broken)))
    assert len(log.observations) == 2


@pytest.mark.parametrize("announced", [1, 2, 4, 5])
@pytest.mark.parametrize("line", [flaser("1.5 2.5 3.5", "4 5 6", "7 8 9", 2), robotlaser("1.5 2.5 3.5", 2)])
def test_a_scan_with_other_than_the_announced_beams_is_passed_over(tmp_path: Path, line: str, announced: int):
    """Nothing else tells a range from a pose, or a pose from a stamp."""
    miscounted = line.replace(" 3 1.5 ", f" {announced} 1.5 ")
    log = read_carmen(written(tmp_path, line + miscounted + line))
    assert [seen.time_s for seen in log.observations] == [2.0, 2.0]
    assert [skipped.number for skipped in log.skipped] == [2]


@pytest.mark.parametrize("words", [1, 2])
def test_a_line_that_was_cut_within_its_stamps_is_passed_over(tmp_path: Path, words: int):
    """The stamp that is the last word may be half of it."""
    good = flaser("1 2", "0 0 0", "0 0 0", 1234.5)
    odom = f"ODOM 1 2 3 0 0 0 1234.5 {TAIL}\n"
    cut = [" ".join(line.split()[:-words]) + "\n" for line in (good, odom)]
    log = read_carmen(written(tmp_path, good + "".join(cut)))
    assert [(skipped.number, skipped.reason[-9:]) for skipped in log.skipped] == [
        (2, "cut short"),
        (3, "cut short"),
    ]


def test_without_odometry_every_pose_is_the_identity(tmp_path: Path):
    text = "".join(flaser("1 2", "7 7 1", "7 7 1", float(t)) for t in range(3))
    log = read_carmen(written(tmp_path, text))
    assert not log.has_odometry
    assert {seen.odom_from_robot for seen in log.observations} == {Pose2.identity()}


def test_odom_lines_stand_in_for_scans_that_carry_none(tmp_path: Path):
    text = "".join(f"ODOM {t} 0 0 0 0 0 {t} host {t}\n" for t in (0.0, 1.0, 2.0))
    text += "".join(flaser("1 2", "0 0 0", "0 0 0", t) for t in (0.5, 1.25))
    log = read_carmen(written(tmp_path, text))
    assert log.has_odometry
    assert [seen.odom_from_robot.x_m for seen in log.observations] == [0.5, 1.25]


def test_raw_scans_take_their_poses_from_odom_lines_and_the_mount_from_the_parameters(tmp_path: Path):
    text = "PARAM robot_frontlaser_offset 0.2 0 host 0\n"
    text += "".join(f"ODOM {t} 0 0 0 0 0 {t} host {t}\n" for t in (0.0, 1.0, 2.0))
    text += "".join(rawlaser("1 2 8.0 3", t) for t in (0.5, 1.25))
    log = read_carmen(written(tmp_path, text))
    assert [seen.odom_from_robot.x_m for seen in log.observations] == [0.5, 1.25]
    assert log.observations[0].robot_from_lidar == Pose2(0.2, 0.0, 0.0)
    np.testing.assert_array_equal(log.observations[0].scan.ranges_m, [1, 2, np.inf, 3])
    np.testing.assert_allclose(log.observations[0].scan.bearings_rad, [-1.5, -1.0, -0.5, 0.0])


def test_raw_scans_are_not_read_where_the_same_scans_come_with_poses(tmp_path: Path):
    text = "".join(rawlaser("1 2", t) for t in range(3)) + robotlaser("1 2 3", 2)
    (seen,) = read_carmen(written(tmp_path, text)).observations
    assert len(seen.scan.ranges_m) == 3


@pytest.mark.parametrize("compress", [bz2.compress, gzip.compress, bytes])
def test_compressed_files_read_as_they_are_whatever_their_name(tmp_path: Path, compress):
    text = "".join(flaser("1 2", f"{t} 0 0", f"{t} 0 0", t) for t in (1.0, 2.0))
    path = tmp_path / "some.clf"
    path.write_bytes(compress(text.encode()))
    assert len(read_log(path).observations) == 2


@pytest.mark.parametrize("compress", [bz2.compress, gzip.compress])
def test_an_archive_cut_short_gives_what_came_before_the_cut(tmp_path: Path, compress):
    rng = np.random.default_rng(0)
    lines = [
        flaser(" ".join(map(str, rng.random(180))), f"{t} 0 0", f"{t} 0 0", float(t)) for t in range(2000)
    ]
    packed = compress("".join(lines).encode())
    path = tmp_path / "cut.log"
    path.write_bytes(packed[: len(packed) * 3 // 4])
    log = read_log(path)
    assert 500 < len(log.observations) < 2000
    assert "the file ends here" in log.skipped[-1].reason


@pytest.mark.parametrize("text", ["", "hello\n", "ODOM 1 2\n"])
def test_a_file_without_a_scan_is_refused(tmp_path: Path, text: str):
    with pytest.raises(ValueError, match="holds no laser scan"):
        read_log(written(tmp_path, text))


def test_a_file_of_broken_scans_is_refused_with_the_first_line_and_what_is_wrong_with_it(tmp_path: Path):
    text = "# metres with commas\n" + flaser("1,5 2,5", "0 0 0", "0 0 0", 1.0)
    with pytest.raises(
        ValueError, match="1 broken, first 2: FLASER: could not convert string to float: '1,5'"
    ):
        read_log(written(tmp_path, text))


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match=r"there is no log .*none\.log"):
        read_log(tmp_path / "none.log")
