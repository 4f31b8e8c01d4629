"""Where the robot is in its map: the protocol, and its simplest keeper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.localization.undistortion import undistorted
from occmap.scan import Observation, Scan


@dataclass(frozen=True)
class Estimate:
    """Where a localizer believes the robot to be, and what that means for the map."""

    map_from_robot: Pose2
    insert: bool = True
    """Whether the scan is worth spending on the grid (a motion filter says no when little moved)."""
    grid: OccupancyGrid | None = None
    """The map rebuilt from corrected poses, owned by the receiver from now on; this scan is not in it yet."""
    map_shift: Pose2 | None = None
    """new_map_from_old_map near the robot, given with `grid`: carries goals and paths over the correction."""
    scan: Scan | None = None
    """The scan as seen from that one pose, if the robot moved while the beams were cast, or as it is kept to
    build the map anew; insert this one."""
    is_lost: bool = False
    """Whether the pose is a guess: what is seen does not fit the map there, or has yet to be found on it."""


class Localizer(Protocol):
    """Turns what the robot senses into where it is. The first update defines the map frame."""

    def update(self, seen: Observation) -> Estimate:
        """Estimate where the robot is, given the next of its observations."""
        ...


class OdometryLocalizer:
    """Believes the wheels: the odometry's first pose is the map's origin, and stays so.

    Serves a known pose as well: hand the true pose in as a perfect odometry.
    """

    def __init__(self) -> None:
        self._map_from_odom: Pose2 | None = None
        self._last: Observation | None = None

    def update(self, seen: Observation) -> Estimate:
        """The pose as the wheels have it; a scan taken in motion as seen from there."""
        if self._map_from_odom is None:
            self._map_from_odom = seen.odom_from_robot.inverse()
        scan = self._undistorted(seen)
        self._last = seen
        return Estimate(self._map_from_odom @ seen.odom_from_robot, scan=None if scan is seen.scan else scan)

    def _undistorted(self, seen: Observation) -> Scan:
        """The scan as seen from one place, as far as the wheels know."""
        if self._last is None:
            return seen.scan
        step = self._last.odom_from_robot.inverse() @ seen.odom_from_robot
        return undistorted(seen.scan, seen.robot_from_lidar, step, seen.time_s - self._last.time_s)
