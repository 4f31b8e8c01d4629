"""ROS bags: ROS 2 folders, MCAP and SQLite files, and ROS 1 `.bag` files, through the rosbags library.

Needs the optional extra `ros`. Scans are sensor_msgs/LaserScan; the robot's odometry is nav_msgs/Odometry
or, without it, the transforms in /tf; where the laser sits is in /tf_static.
"""

from __future__ import annotations

import sqlite3
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.logs.log import MIN_RANGE_M, RecordedLog, Skipped
from experiments.logs.pose_track import PoseTrack
from experiments.logs.transforms import FrameTree, in_plane, is_upside_down, matrix
from occmap.geometry import Pose2
from occmap.scan import Observation, Scan

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

LASER, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
LONGEST_RANGE_M = 300.0
"""No lidar in a plane sees farther. Drivers that do not know say inf, or the largest number that there is."""
LONGEST_TURN_S = 1.0
"""A time_increment that makes a turn last longer is a driver's fault, and not believed."""


@dataclass
class Messages:
    """What a bag holds, before anything is put together."""

    scans: list[tuple[float, Any]] = field(default_factory=list)
    odometry: list[tuple[float, str, Pose2]] = field(default_factory=list)
    frames: FrameTree = field(default_factory=FrameTree)
    skipped: list[Skipped] = field(default_factory=list)


def read_bag(path: Path, scan_topic: str | None = None, odometry_topic: str | None = None) -> RecordedLog:
    """All scans of one topic, sorted by their own stamps. Topics not named are the first of their type."""
    messages = _collect(path, scan_topic, odometry_topic)
    messages.scans.sort(key=lambda stamped: stamped[0])
    if not messages.scans:
        return RecordedLog((), False, tuple(messages.skipped))
    laser = messages.scans[0][1].header.frame_id
    base, track = _odometry(messages, laser)
    robot_from_lidar = messages.frames.mount(base, laser)
    clockwise, mount = is_upside_down(robot_from_lidar), in_plane(robot_from_lidar)
    observations = []
    for number, (time_s, message) in enumerate(messages.scans, start=1):
        try:
            pose = track.at(time_s) if track else Pose2.identity()
            observations.append(Observation(time_s, pose, _scan(message, clockwise), mount))
        except ValueError as error:
            messages.skipped.append(Skipped(number, f"scan: {error}"))
    return RecordedLog(tuple(observations), track is not None, tuple(messages.skipped))


def _odometry(messages: Messages, laser: str) -> tuple[str, PoseTrack | None]:
    """The robot's frame and where it was: from Odometry messages, else from the transforms."""
    if messages.odometry:
        times_s, children, poses = zip(*messages.odometry, strict=True)
        return children[0], PoseTrack(list(times_s), list(poses))
    found = messages.frames.odometry(laser)
    return (found.base, found.track) if found else (messages.frames.body(laser), None)


def _collect(path: Path, scan_topic: str | None, odometry_topic: str | None) -> Messages:
    """One pass over the bag."""
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise ValueError(f"reading {path} needs the optional extra: pip install 'occmap[ros]'") from error
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.LATEST))
        reader.open()
    except (AnyReaderError, OSError, sqlite3.Error, struct.error) as error:
        raise ValueError(f"cannot read the bag {path}: {error}") from error
    try:
        topics = {
            LASER: _topic(reader.connections, LASER, scan_topic, path),
            ODOMETRY: _topic(reader.connections, ODOMETRY, odometry_topic, path),
        }
        return _deserialised(
            reader,
            [c for c in reader.connections if topics.get(c.msgtype) == c.topic or c.msgtype in TRANSFORMS],
        )
    finally:
        reader.close()


def _deserialised(reader: AnyReader, wanted: list[Any]) -> Messages:
    """All messages of some connections; one that cannot be read is noted by its place and passed over.

    A broken message makes the library raise nearly anything, hence the wide net.
    """
    messages, number = Messages(), 0
    stream = reader.messages(wanted) if wanted else iter(())
    while True:
        number += 1
        try:
            connection, stamp_ns, raw = next(stream)
        except StopIteration:
            return messages
        except Exception as error:
            messages.skipped.append(Skipped(number, f"the bag ends here: {error}"))
            return messages
        try:
            message = reader.deserialize(raw, connection.msgtype)
            _keep(messages, connection.topic, connection.msgtype, message, stamp_ns * 1e-9)
        except Exception as error:
            messages.skipped.append(Skipped(number, f"{connection.topic}: {error}"))


def _topic(connections: list[Any], kind: str, named: str | None, path: Path) -> str | None:
    """The topic to read: the one named, else the first of its kind."""
    topics = sorted({connection.topic for connection in connections if connection.msgtype == kind})
    if named is not None and named not in topics:
        raise ValueError(f"{path} has no {kind} on {named}; it has {', '.join(topics) or 'none at all'}")
    return named or (topics[0] if topics else None)


def _keep(messages: Messages, topic: str, kind: str, message: Any, logged_s: float) -> None:
    """File one message under what it is."""
    if kind in TRANSFORMS:
        for stamped in message.transforms:
            at, turn = stamped.transform.translation, stamped.transform.rotation
            transform = matrix((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
            time_s, parent = _stamp(stamped.header, logged_s), stamped.header.frame_id
            messages.frames.add(parent, stamped.child_frame_id, time_s, transform, "static" in topic)
        return
    time_s = _stamp(message.header, logged_s)
    if kind == LASER:
        messages.scans.append((time_s, message))
    else:
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        pose = in_plane(matrix((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)))
        messages.odometry.append((time_s, message.child_frame_id, pose))


def _stamp(header: Any, logged_s: float) -> float:
    """Seconds of a header, or when the message was logged if it has no stamp."""
    time_s = header.stamp.sec + header.stamp.nanosec * 1e-9
    return time_s if time_s > 0.0 else logged_s


def _scan(message: Any, clockwise: bool) -> Scan:
    """A LaserScan as a Scan (REP 117: inf and beyond range_max is no return, -inf is too near)."""
    ranges = np.array(message.ranges, np.float64)
    max_range_m = min(float(message.range_max), LONGEST_RANGE_M)
    min_range_m = max(float(message.range_min), MIN_RANGE_M)
    if not max_range_m > min_range_m:
        raise ValueError(f"ranges from {message.range_min} to {message.range_max} m")
    ranges = np.where(ranges >= max_range_m, np.inf, np.where(np.isneginf(ranges), np.nan, ranges))
    beam = np.arange(len(ranges), dtype=np.float64)
    bearings = float(message.angle_min) + float(message.angle_increment) * beam
    if len(ranges) == 0 or not np.all(np.isfinite(bearings)):
        raise ValueError(f"{len(ranges)} beams from {message.angle_min} by {message.angle_increment} rad")
    turn_s = float(message.time_increment) * len(ranges)
    beam_times_s = float(message.time_increment) * beam if 0.0 < turn_s <= LONGEST_TURN_S else None
    return Scan(-bearings if clockwise else bearings, ranges, max_range_m, min_range_m, beam_times_s)
