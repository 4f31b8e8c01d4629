"""CARMEN log files: one message a line, ending in `ipc_timestamp host logger_timestamp`.

    FLASER n r1..rn  laser_x laser_y laser_yaw  odom_x odom_y odom_yaw
    ROBOTLASER1 type start fov step maxrange accuracy remission_mode n r1..rn m rem1..rem_m
                laser_x laser_y laser_yaw  robot_x robot_y robot_yaw  tv rv forward side turn
    RAWLASER1 type start fov step maxrange accuracy remission_mode n r1..rn m rem1..rem_m
    ODOM x y yaw tv rv acceleration
    PARAM name value

Metres and radians. The format is the CARMEN toolkit's; what its files get up to was found by reading them.
"""

from __future__ import annotations

import bz2
import gzip
import math
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from io import BufferedIOBase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.logs.log import MIN_RANGE_M, RecordedLog, Skipped
from experiments.logs.no_return import no_return_code
from experiments.logs.pose_track import PoseTrack
from experiments.logs.scan_order import in_driven_order
from experiments.planar import wrapped
from occmap.geometry import Pose2
from occmap.scan import Observation, Scan

FLASER_MAX_RANGE_M = 50.0
"""FLASER does not say how far its sensor reaches; codes for "no return" start here (50.0, 81.83, 81.91), or
where they are found to be (no_return)."""
NO_RETURN_SHARE = 0.998
"""Of the maximum range or such a code: SICK's error codes, 81.83 to 81.91, begin just short of its 81.92."""
FLASER_STEP_DEG = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5, 401: 0.25, 541: 0.5, 1081: 0.25}
"""By number of beams, of the sensors in the wild; any other number is spread over 180 degrees."""
MOUNT_TOLERANCE = 0.02
"""Metres and radians within which the laser stays put on a robot."""


@dataclass(frozen=True)
class LaserMessage:
    """One FLASER, ROBOTLASER1 or RAWLASER1 line; the last knows no poses, and has the identity for both."""

    time_s: float
    scan: Scan
    odom_from_lidar: Pose2
    odom_from_robot: Pose2


def read_carmen(path: Path) -> RecordedLog:
    """All scans of a file, in the order of their ipc timestamps, or of the file if that is clearly truer."""
    lasers: dict[str, list[LaserMessage]] = {"ROBOTLASER1": [], "FLASER": [], "RAWLASER1": []}
    odometry: list[tuple[float, Pose2]] = []
    skipped: list[Skipped] = []
    parameters: dict[str, str] = {}
    for number, line in _lines(path, skipped):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            if words[0] == "FLASER":
                lasers["FLASER"].append(_flaser(words))
            elif words[0] == "ROBOTLASER1":
                lasers["ROBOTLASER1"].append(_robotlaser(words))
            elif words[0] == "RAWLASER1":
                lasers["RAWLASER1"].append(_rawlaser(words))
            elif words[0] == "ODOM":
                odometry.append((_time_s(words[7:]), _pose(words[1:4])))
            elif words[0] == "PARAM":
                parameters[words[1]] = words[2]
            elif not re.fullmatch(r"[A-Z][A-Z0-9_-]*", words[0]):
                raise ValueError(f"no CARMEN message begins with {words[0][:20]!r}")
        except (ValueError, IndexError) as error:
            reason = "cut short" if isinstance(error, IndexError) else str(error)
            skipped.append(Skipped(number, f"{words[0][:20]}: {reason}"))
    raw = lasers.pop("RAWLASER1")
    messages = max(lasers.values(), key=len)  # not both: loggers that know both write every scan twice
    return _recorded(messages or raw, odometry, parameters, skipped)


def _recorded(
    messages: list[LaserMessage],
    odometry: list[tuple[float, Pose2]],
    parameters: dict[str, str],
    skipped: list[Skipped],
) -> RecordedLog:
    """Decide, with the whole log read, where the laser sits and whose odometry to believe."""
    messages = _without_code(messages)
    robot_from_lidar = _mount(messages, parameters)
    odom_from_robots = [message.odom_from_robot for message in messages]
    if not _moves(odom_from_robots) and _moves([pose for _, pose in odometry]):
        track = PoseTrack([time_s for time_s, _ in odometry], [pose for _, pose in odometry])
        odom_from_robots = [track.at(message.time_s) for message in messages]
    has_odometry = _moves(odom_from_robots)
    observations = [
        Observation(
            message.time_s,
            odom_from_robot if has_odometry else Pose2.identity(),
            message.scan,
            robot_from_lidar,
        )
        for message, odom_from_robot in zip(messages, odom_from_robots, strict=True)
    ]
    return RecordedLog(tuple(in_driven_order(observations)), has_odometry, tuple(skipped))


def _without_code(messages: list[LaserMessage]) -> list[LaserMessage]:
    """The messages, with beams that met nothing told from those that did."""
    code_m = no_return_code([message.scan for message in messages])
    if code_m is None:
        return messages
    scans = [
        replace(message.scan, ranges_m=_cut_off(message.scan.ranges_m, NO_RETURN_SHARE * code_m))
        for message in messages
    ]
    return [replace(message, scan=scan) for message, scan in zip(messages, scans, strict=True)]


def _mount(messages: list[LaserMessage], parameters: dict[str, str]) -> Pose2:
    """robot_from_lidar: what the two poses of the messages agree on, else what the parameters say.

    They agree on nothing where the laser's pose was corrected after the fact and the odometry was not, and
    say nothing where both are left at zero.
    """
    silent = not _moves([message.odom_from_robot for message in messages])
    mounts = [message.odom_from_robot.inverse() @ message.odom_from_lidar for message in messages]
    rows = np.array([(mount.x_m, mount.y_m, mount.yaw_rad) for mount in mounts]).reshape(-1, 3)
    if rows.any() or not silent:
        rows[:, 2] = rows[0, 2] + wrapped(rows[:, 2] - rows[0, 2])  # a laser that looks back is at pi and -pi
        middle = np.median(rows, axis=0)
        if np.all(np.percentile(np.abs(rows - middle), 90, axis=0) <= MOUNT_TOLERANCE):
            return Pose2(*np.round(middle, 6).tolist())  # six digits are all that a log holds
    try:
        return Pose2(float(parameters.get("robot_frontlaser_offset", "0")), 0.0, 0.0)
    except ValueError:
        return Pose2.identity()


def _moves(poses: list[Pose2]) -> bool:
    return any(pose != poses[0] for pose in poses)


def _flaser(words: list[str]) -> LaserMessage:
    n = _beams(words[1])
    ranges, rest = _ranges(words[2 : 2 + n], n, FLASER_MAX_RANGE_M), words[2 + n :]
    scan = Scan(_flaser_bearings(n), ranges, FLASER_MAX_RANGE_M, MIN_RANGE_M)
    return LaserMessage(_time_s(rest[6:]), scan, _pose(rest[0:3]), _pose(rest[3:6]))


def _robotlaser(words: list[str]) -> LaserMessage:
    scan, rest = _described_scan(words)
    return LaserMessage(_time_s(rest[11:]), scan, _pose(rest[0:3]), _pose(rest[3:6]))


def _rawlaser(words: list[str]) -> LaserMessage:
    scan, rest = _described_scan(words)
    return LaserMessage(_time_s(rest), scan, Pose2.identity(), Pose2.identity())


def _described_scan(words: list[str]) -> tuple[Scan, list[str]]:
    """A scan that says what sensor it is of, and what follows it in the line."""
    start, fov, step, max_range_m = map(_finite, words[2:6])
    n = _beams(words[8])
    ranges = _ranges(words[9 : 9 + n], n, NO_RETURN_SHARE * max_range_m)
    remissions = int(words[9 + n])
    if not max_range_m > MIN_RANGE_M:
        raise ValueError(f"a maximum range of {max_range_m} m")
    if not 0.0 < step * (n - 1) <= 1.05 * fov:  # no step, or that of another number of beams
        step = fov / max(n - 1, 1)
    return Scan(_bearings(start, step, n), ranges, max_range_m, MIN_RANGE_M), words[10 + n + remissions :]


@lru_cache(maxsize=64)
def _flaser_bearings(n: int) -> NDArray[np.float64]:
    """Right to left, symmetric about forward up to one beam."""
    half = max(n // 2, 1)
    step = math.radians(FLASER_STEP_DEG.get(n, 90.0 / half))
    return _bearings(-step * half, step, n)


@lru_cache(maxsize=64)
def _bearings(start: float, step: float, n: int) -> NDArray[np.float64]:
    bearings = start + step * np.arange(n, dtype=np.float64)
    bearings.flags.writeable = False  # shared by all scans of a log
    return bearings


def _ranges(words: list[str], n: int, no_return_m: float) -> NDArray[np.float64]:
    """(n,) metres; inf for a beam that met nothing."""
    if len(words) != n:
        raise ValueError(f"{n} beams announced, {len(words)} found")
    return _cut_off(np.array(words, np.float64), no_return_m)


def _cut_off(ranges: NDArray[np.float64], no_return_m: float) -> NDArray[np.float64]:
    return np.where(ranges >= no_return_m, np.inf, ranges)


def _pose(words: list[str]) -> Pose2:
    x, y, yaw = words
    return Pose2(float(x), float(y), float(yaw))


def _time_s(ending: list[str]) -> float:
    """The ipc timestamp. A line that does not end where it should is one whose numbers were miscounted."""
    if len(ending) > 3:
        raise ValueError(f"values beyond those announced: {len(ending) - 3}")
    _ = _finite(ending[2])  # the logger's own stamp, or the line was cut short
    return _finite(ending[0])


def _finite(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"{word} is no finite number")
    return value


def _beams(word: str) -> int:
    n = int(word)
    if n < 1:
        raise ValueError(f"a scan of {n} beams")
    return n


def _lines(path: Path, skipped: list[Skipped]) -> Iterator[tuple[int, str]]:
    """Numbered lines; an archive that is cut short gives those before the cut."""
    number = 0
    try:
        with _open(path) as file:
            for raw in file:
                number += 1
                yield number, raw.decode("ascii", errors="replace")
    except (EOFError, OSError, zlib.error) as error:
        if number == 0:
            raise ValueError(f"cannot read {path}: {error}") from error
        skipped.append(Skipped(number + 1, f"the file ends here: {error}"))


def _open(path: Path) -> BufferedIOBase:
    """By content, not by name: gzip, bzip2 or plain."""
    with path.open("rb") as file:
        magic = file.read(3)
    if magic == b"BZh":
        return bz2.open(path)
    if magic[:2] == b"\x1f\x8b":
        return gzip.open(path)
    return path.open("rb")
