"""What a robot senses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points, Pose2

NO_RANGE_M = 1e-3
"""No lidar measures less: it stands for 0."""


@dataclass(frozen=True)
class Scan:
    """One turn of the lidar, in the lidar's frame; bearings are counter-clockwise from its forward axis.

    Ranges follow REP 117. A beam that met nothing has range inf, or any from max_range_m on: free up to
    max_range_m, unknown beyond; if its neighbours met nothing either (see SensorModelConfig).
    A beam that failed has range nan: it says nothing. Nor does one that met something too near to measure,
    -inf, nor any range below min_range_m, nor 0, which some drivers write for a beam that failed.

    Beams that end on the robot itself must be nan, or below min_range_m: they would be obstacles that go
    wherever it goes. Arrays of other types and orders are copied into float64.
    """

    bearings_rad: NDArray[np.float64]  # (n,)
    ranges_m: NDArray[np.float64]  # (n,)
    max_range_m: float
    min_range_m: float = 0.0
    beam_times_s: NDArray[np.float64] | None = None
    """(n,) when each beam was cast, in seconds after the observation's time_s, negative before it: localizers
    then undo the robot's motion. None: all at once, or undone already."""

    def __post_init__(self) -> None:
        self._hold_what_kernels_take()
        if self.bearings_rad.shape != self.ranges_m.shape or self.ranges_m.ndim != 1:
            raise ValueError(
                "bearings and ranges must be of one length, "
                f"got {self.bearings_rad.shape} and {self.ranges_m.shape}"
            )
        if self.beam_times_s is not None and self.beam_times_s.shape != self.ranges_m.shape:
            raise ValueError(
                f"beam_times_s must have shape {self.ranges_m.shape}, got {self.beam_times_s.shape}"
            )
        for name in ("bearings_rad", "beam_times_s"):
            _refuse_what_is_not_finite(name, getattr(self, name))
        if not 0.0 <= self.min_range_m < self.max_range_m:
            raise ValueError(
                f"need 0 <= min_range_m < max_range_m, got {self.min_range_m} and {self.max_range_m}"
            )

    def _hold_what_kernels_take(self) -> None:
        """Arrays and numbers of one type: for another all kernels would be compiled again, in mid-drive."""
        for name in ("bearings_rad", "ranges_m"):
            object.__setattr__(self, name, np.require(getattr(self, name), np.float64, ("C", "W")))
        for name in ("max_range_m", "min_range_m"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def least_range_m(self) -> float:
        """The shortest range that says something."""
        return max(self.min_range_m, NO_RANGE_M)

    @property
    def is_hit(self) -> NDArray[np.bool_]:
        """(n,) which beams ended on something."""
        is_in_range = (self.ranges_m >= self.least_range_m) & (self.ranges_m < self.max_range_m)
        return np.isfinite(self.ranges_m) & is_in_range

    def hits_in_lidar(self) -> Points:
        """(k, 2) end points of the beams that hit, in metres, in the lidar's frame."""
        hit = self.is_hit
        ranges, bearings = self.ranges_m[hit], self.bearings_rad[hit]
        return np.column_stack((ranges * np.cos(bearings), ranges * np.sin(bearings)))


def _refuse_what_is_not_finite(name: str, values: NDArray[np.float64] | None) -> None:
    if values is not None and not math.isfinite(values.sum()):
        beam = int(np.argmin(np.isfinite(values)))
        raise ValueError(f"{name} must be finite, of failed beams too, got {values[beam]} of beam {beam}")


@dataclass(frozen=True)
class Observation:
    """All that a robot knows of one instant: where its wheels say it is, and what its lidar sees."""

    time_s: float
    """The instant of odom_from_robot, and the one that beam_times_s count from; by any clock in seconds."""
    odom_from_robot: Pose2
    """Where the wheels say the robot is at time_s; counted from anywhere. Always the same without odometry:
    then only a localizer that matches scans, SlamLocalizer, can tell how the robot moved."""
    scan: Scan
    robot_from_lidar: Pose2
    """Where on the robot the lidar sits; the robot's own origin is the middle between its wheels."""

    def __post_init__(self) -> None:
        if not math.isfinite(self.time_s):
            raise ValueError(f"time_s must be finite, got {self.time_s}")
