"""ROS bags, written by the library that reads them."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from experiments.logs.log import read_log
from experiments.replay import main
from experiments.tum_file import read_tum
from occmap.geometry import Pose2

rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="needs the optional extra ros")
typesys = pytest.importorskip("rosbags.typesys")
TYPES = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
M = TYPES.types


def header(time_s: float, frame: str):
    stamp = M["builtin_interfaces/msg/Time"](sec=int(time_s), nanosec=round(time_s % 1 * 1e9))
    return M["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def quaternion(yaw: float = 0.0, upside_down: bool = False):
    half = yaw / 2
    x, y, z, w = (
        (math.cos(half), math.sin(half), 0.0, 0.0)
        if upside_down
        else (0.0, 0.0, math.sin(half), math.cos(half))
    )
    return M["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)


def laser_scan(
    time_s: float, ranges: list[float], frame: str = "laser", reach_m: tuple[float, float] = (0.1, 10.0)
):
    return "sensor_msgs/msg/LaserScan", M["sensor_msgs/msg/LaserScan"](
        header=header(time_s, frame),
        angle_min=-0.2,
        angle_max=0.2,
        angle_increment=0.1,
        time_increment=0.001,
        scan_time=0.1,
        range_min=reach_m[0],
        range_max=reach_m[1],
        ranges=np.array(ranges, np.float32),
        intensities=np.zeros(0, np.float32),
    )


def odometry(time_s: float, pose: Pose2, child: str = "base_link"):
    vector, point = M["geometry_msgs/msg/Vector3"], M["geometry_msgs/msg/Point"]
    inner = M["geometry_msgs/msg/Pose"](
        position=point(x=pose.x_m, y=pose.y_m, z=0.0), orientation=quaternion(pose.yaw_rad)
    )
    twist = M["geometry_msgs/msg/Twist"](
        linear=vector(x=0.0, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0)
    )
    return "nav_msgs/msg/Odometry", M["nav_msgs/msg/Odometry"](
        header=header(time_s, "odom"),
        child_frame_id=child,
        pose=M["geometry_msgs/msg/PoseWithCovariance"](pose=inner, covariance=np.zeros(36)),
        twist=M["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
    )


def transform(time_s: float, parent: str, child: str, pose: Pose2, upside_down: bool = False):
    vector = M["geometry_msgs/msg/Vector3"]
    stamped = M["geometry_msgs/msg/TransformStamped"](
        header=header(time_s, parent),
        child_frame_id=child,
        transform=M["geometry_msgs/msg/Transform"](
            translation=vector(x=pose.x_m, y=pose.y_m, z=0.3), rotation=quaternion(pose.yaw_rad, upside_down)
        ),
    )
    return "tf2_msgs/msg/TFMessage", M["tf2_msgs/msg/TFMessage"](transforms=[stamped])


def bag(path: Path, messages: list[tuple[float, str, tuple]], storage: str = "MCAP") -> Path:
    """Messages (logged_s, topic, (type, message or raw bytes)) as a ROS 2 bag."""
    with rosbag2.Writer(path, version=9, storage_plugin=getattr(rosbag2.StoragePlugin, storage)) as writer:
        topics = {}
        for logged_s, topic, (kind, message) in messages:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            raw = message if isinstance(message, bytes) else TYPES.serialize_cdr(message, kind)
            writer.write(topics[topic], int(logged_s * 1e9), raw)
    return path


RANGES = [1.0, 0.05, math.inf, math.nan, 11.0]


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_scans_and_odometry_and_the_mount(tmp_path: Path, storage: str):
    messages = [(0.0, "/tf_static", transform(0.0, "base_link", "laser", Pose2(0.1, 0.02, 0.5)))]
    for t in (1.0, 2.0, 3.0):
        messages.append((t, "/odom", odometry(t, Pose2(t, 0.0, 0.1 * t))))
        messages.append((t + 0.01, "/scan", laser_scan(t + 0.5, RANGES)))
    log = read_log(bag(tmp_path / "bag", messages, storage))
    first = log.observations[0]
    assert [seen.time_s for seen in log.observations] == [1.5, 2.5, 3.5]
    assert first.odom_from_robot.x_m == pytest.approx(1.5)
    assert first.odom_from_robot.yaw_rad == pytest.approx(0.15)
    assert first.robot_from_lidar.position == pytest.approx((0.1, 0.02))
    assert first.robot_from_lidar.yaw_rad == pytest.approx(0.5)
    np.testing.assert_array_equal(first.scan.is_hit, [True, False, False, False, False])
    np.testing.assert_array_equal(np.isposinf(first.scan.ranges_m), [False, False, True, False, True])
    np.testing.assert_allclose(first.scan.bearings_rad, [-0.2, -0.1, 0.0, 0.1, 0.2], atol=1e-6)
    np.testing.assert_allclose(first.scan.beam_times_s, [0, 0.001, 0.002, 0.003, 0.004], atol=1e-7)
    assert log.has_odometry
    assert log.skipped == ()


def test_a_single_mcap_file_reads_like_its_folder(tmp_path: Path):
    folder = bag(tmp_path / "bag", [(1.0, "/scan", laser_scan(1.0, RANGES))])
    (file,) = folder.glob("*.mcap")
    assert len(read_log(file).observations) == 1


def test_transforms_stand_in_for_odometry(tmp_path: Path):
    messages = [
        (0.0, "/tf_static", transform(0.0, "base_link", "laser", Pose2(0.1, 0.0, 0.0))),
        (0.0, "/tf_static", transform(0.0, "base_footprint", "base_link", Pose2(0.2, 0.0, 0.0))),
    ]
    for t in (1.0, 2.0):
        messages.append((t, "/tf", transform(t, "odom", "base_footprint", Pose2(2 * t, 0.0, 0.0))))
        messages.append((t, "/tf", transform(t, "map", "odom", Pose2(50.0 + t, 0.0, 0.0))))
    messages.append((1.5, "/scan", laser_scan(1.5, RANGES)))
    (seen,) = read_log(bag(tmp_path / "bag", messages)).observations
    assert seen.odom_from_robot.x_m == pytest.approx(3.0)
    assert seen.robot_from_lidar.x_m == pytest.approx(0.3)


def test_a_laser_hung_upside_down_turns_the_other_way(tmp_path: Path):
    messages = [
        (0.0, "/tf_static", transform(0.0, "base_link", "laser", Pose2(0.1, 0.0, 0.0), upside_down=True)),
        (1.0, "/odom", odometry(1.0, Pose2.identity())),
        (1.0, "/scan", laser_scan(1.0, RANGES)),
    ]
    (seen,) = read_log(bag(tmp_path / "bag", messages)).observations
    np.testing.assert_allclose(seen.scan.bearings_rad, [0.2, 0.1, 0.0, -0.1, -0.2], atol=1e-6)


@pytest.mark.parametrize("child", ["", "base_footprint"])
def test_the_mount_is_found_though_odometry_names_no_frame_that_there_is(tmp_path: Path, child: str):
    """Else a laser that hangs upside down sees a mirror image."""
    mount = Pose2(0.1, 0.02, 0.5)
    messages = [
        (0.0, "/tf_static", transform(0.0, "robot_1/base_link", "laser", mount, upside_down=True)),
        (1.0, "/odom", odometry(1.0, Pose2.identity(), child)),
        (1.0, "/scan", laser_scan(1.0, RANGES)),
    ]
    (seen,) = read_log(bag(tmp_path / "bag", messages)).observations
    assert (seen.robot_from_lidar.x_m, seen.robot_from_lidar.y_m) == pytest.approx((0.1, 0.02))
    assert seen.scan.bearings_rad[0] == pytest.approx(0.2)


def test_a_transform_that_is_sent_again_and_again_is_no_odometry(tmp_path: Path):
    messages = [(0.0, "/tf_static", transform(0.0, "base_link", "laser", Pose2(0.1, 0.0, 0.0)))]
    for t in (1.0, 2.0):
        messages.append((t, "/tf", transform(t, "world", "map", Pose2(5.0, 0.0, 0.0))))
        messages.append((t, "/tf", transform(t, "map", "base_link", Pose2(2 * t, 0.0, 0.0))))
    messages.append((1.5, "/scan", laser_scan(1.5, RANGES)))
    (seen,) = read_log(bag(tmp_path / "bag", messages)).observations
    assert seen.odom_from_robot.x_m == pytest.approx(3.0)
    assert seen.robot_from_lidar.x_m == pytest.approx(0.1)


def test_without_odometry_or_transforms_it_still_reads(tmp_path: Path):
    log = read_log(bag(tmp_path / "bag", [(t, "/scan", laser_scan(t, RANGES)) for t in (1.0, 2.0)]))
    assert not log.has_odometry
    assert [seen.odom_from_robot for seen in log.observations] == [Pose2.identity()] * 2


@pytest.mark.parametrize("range_min", [0.0, -1.0])
def test_a_range_of_zero_is_no_hit_whatever_the_driver_says(tmp_path: Path, range_min: float):
    scan = laser_scan(1.0, [0.0, 1.0, 0.0, 2.0, 0.05], reach_m=(range_min, 10.0))
    (seen,) = read_log(bag(tmp_path / "bag", [(1.0, "/scan", scan)])).observations
    np.testing.assert_array_equal(seen.scan.is_hit, [False, True, False, True, True])


@pytest.mark.parametrize("range_max", [math.inf, float(np.finfo(np.float32).max)])
def test_a_driver_that_does_not_know_how_far_it_sees_is_read(tmp_path: Path, range_max: float):
    scan = laser_scan(1.0, [1.0, 90.0, math.inf, math.nan, -math.inf], reach_m=(0.1, range_max))
    (seen,) = read_log(bag(tmp_path / "bag", [(1.0, "/scan", scan)])).observations
    np.testing.assert_array_equal(seen.scan.is_hit, [True, True, False, False, False])
    np.testing.assert_array_equal(np.isposinf(seen.scan.ranges_m), [False, False, True, False, False])
    assert seen.scan.max_range_m == 300.0


@pytest.mark.parametrize("reach_m", [(0.1, 0.1), (0.1, math.nan), (math.nan, 10.0)])
def test_a_reach_that_is_none_is_counted(tmp_path: Path, reach_m: tuple[float, float]):
    messages = [
        (1.0, "/scan", laser_scan(1.0, RANGES)),
        (2.0, "/scan", laser_scan(2.0, RANGES, reach_m=reach_m)),
    ]
    log = read_log(bag(tmp_path / "bag", messages))
    assert [skipped.number for skipped in log.skipped] == [2]


def test_a_broken_message_is_counted_by_its_place(tmp_path: Path):
    kind, _ = laser_scan(1.0, RANGES)
    messages = [
        (1.0, "/scan", laser_scan(1.0, RANGES)),
        (2.0, "/scan", (kind, b"\x00\x01\x00\x00broken")),
        (3.0, "/scan", laser_scan(3.0, RANGES)),
    ]
    log = read_log(bag(tmp_path / "bag", messages))
    assert [seen.time_s for seen in log.observations] == [1.0, 3.0]
    assert [skipped.number for skipped in log.skipped] == [2]


def test_of_several_scanners_the_named_one_is_read(tmp_path: Path):
    messages = [(1.0, "/back", laser_scan(1.0, RANGES)), (2.0, "/front", laser_scan(2.0, RANGES))]
    path = bag(tmp_path / "bag", messages)
    assert [seen.time_s for seen in read_log(path, scan_topic="/front").observations] == [2.0]
    with pytest.raises(ValueError, match="it has /back, /front"):
        read_log(path, scan_topic="/scan")


def test_a_bag_replays_like_any_log(tmp_path: Path):
    messages = []
    for t in range(1, 21):
        messages.append((t, "/odom", odometry(t, Pose2(0.1 * t, 0.0, 0.0))))
        messages.append((t, "/scan", laser_scan(t, [3.0 - 0.1 * t] * 5)))
    path = bag(tmp_path / "bag", messages)
    assert main([str(path), "--pose", "odometry", "--no-record", "--out", str(tmp_path / "out")]) == 0
    laser = read_tum(tmp_path / "out" / "laser.tum")
    np.testing.assert_array_equal(laser.times_s, np.arange(1.0, 21.0))
    np.testing.assert_allclose(laser.poses[:, 0], 0.1 * np.arange(20), atol=1e-6)


def test_what_is_no_bag_is_refused(tmp_path: Path):
    (tmp_path / "no.mcap").write_text("hello")
    (tmp_path / "empty").mkdir()
    for name in ("no.mcap", "empty"):
        with pytest.raises(ValueError, match="cannot read the bag"):
            read_log(tmp_path / name)


def test_without_the_extra_the_reader_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = bag(tmp_path / "bag", [(1.0, "/scan", laser_scan(1.0, RANGES))])
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(ValueError, match=r"pip install 'occmap\[ros\]'"):
        read_log(path)
