"""What a recorded log is, whatever its format, and the door to all formats."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from occmap.scan import Observation

BAG_SUFFIXES = (".mcap", ".db3", ".bag")
"""What the ROS reader takes, beside folders; anything else is read as CARMEN text."""
MIN_RANGE_M = 0.02
"""A range of zero is a fault, not an obstacle in the lens, whatever the log says of its sensor."""


@dataclass(frozen=True)
class Skipped:
    """A line or message that could not be read."""

    number: int
    """Its line in the file, or its place among the bag's messages; both count from 1."""
    reason: str


@dataclass(frozen=True)
class RecordedLog:
    """Scans with their odometry, in the order of their stamps, unless those are plainly wrong (scan_order).

    A beam that met nothing has range inf, as in any Scan; how far that is known to be free is not in a
    log, and for its reader to say.
    """

    observations: tuple[Observation, ...]
    has_odometry: bool
    """If not, every odom_from_robot is the identity."""
    skipped: tuple[Skipped, ...] = ()

    @property
    def duration_s(self) -> float:
        """From the earliest scan to the latest: their order may be another."""
        times_s = [seen.time_s for seen in self.observations]
        return max(times_s) - min(times_s)


def read_log(path: Path, scan_topic: str | None = None, odometry_topic: str | None = None) -> RecordedLog:
    """The log in a file, bzip2 and gzip included, or in a bag's folder; the topics are for bags.

    ValueError if there is no such log, or no scan in it.
    """
    if not path.exists():
        raise ValueError(f"there is no log {path}")
    if path.is_dir() or path.suffix in BAG_SUFFIXES:
        from experiments.logs.rosbag import read_bag  # rosbags is an optional extra

        log = read_bag(path, scan_topic, odometry_topic)
    else:
        from experiments.logs.carmen import read_carmen

        log = read_carmen(path)
    if not log.observations:
        complaint = "".join(
            f"; {len(log.skipped)} broken, first {each.number}: {each.reason}" for each in log.skipped[:1]
        )
        raise ValueError(f"{path} holds no laser scan that could be read{complaint}")
    return log
