"""The next metre and a half of a path, as the robot sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from occmap.geometry import Points, Pose2
from occmap.path import Path

SPARE_M = 0.01
"""The line to the aim may come so much nearer to something than the way does: between samples, it may too."""


@dataclass(frozen=True)
class WayConfig:
    """How a path is fitted to what the scan shows."""

    length_m: float = 1.4
    """How much of the path is looked at: braking from full speed takes a quarter of it."""
    spacing_m: float = 0.05
    """Between two samples."""
    beside_m: float = 0.2
    """What lies no farther ahead or behind is beside a sample, to its left or its right."""
    max_shift_m: float = 0.15
    """At most so far is the path moved to the middle of a gap."""
    line_up_m: float = 0.4
    """So long before a gap the way lies on the line through it."""
    gap_ahead_m: float = 0.7
    """So long before a gap the robot slows down if it is not yet on that line."""

    def __post_init__(self) -> None:
        if not 0.0 < self.spacing_m < self.length_m:
            raise ValueError(f"need 0 < spacing_m < length_m, got {self.spacing_m} and {self.length_m}")


@dataclass(frozen=True)
class Drive:
    """How fast the base may go where."""

    top_mps: float
    slow_mps: float
    turn_radps: float
    braking_mps2: float
    near_m: float
    """With obstacles this near its axis, the base goes slow,"""
    roomy_m: float
    """and from here on at top speed."""
    tight_m: float
    """With less room than this, a place is a gap to be lined up with."""


class Way:
    """Samples of a path ahead of the robot, in its frame, moved to the middle of what they pass through."""

    def __init__(self, drive: Drive, config: WayConfig | None = None) -> None:
        from occmap import way_kernels  # compiled on first use, not on import

        self.config = config or WayConfig()
        self.drive = drive
        self.samples: Points = np.empty((0, 2))
        self._kernels = way_kernels
        self._samples = np.empty((round(self.config.length_m / self.config.spacing_m), 2))
        self._room = np.empty((0, way_kernels.ROOMS))

    def place(self, path: Path, robot: Pose2, low_m: float, high_m: float) -> tuple[float, float]:
        """Place where a path passes nearest to the robot: metres along it, within bounds, and how far off."""
        return self._kernels.place_on_path(
            path.waypoints_in_map, path.stations_m, robot.x_m, robot.y_m, low_m, high_m
        )

    def look_along(self, path: Path, from_m: float, robot: Pose2, hits: Points) -> None:
        """Look from from_m along the path on, past the hits (n, 2) of the scan."""
        c = self.config
        n = self._kernels.sample_path(
            path.waypoints_in_map, path.stations_m, from_m, c.spacing_m,
            robot.x_m, robot.y_m, robot.yaw_rad, self._samples,
        )  # fmt: skip
        self.samples = self._samples[:n]
        line_up = round(c.line_up_m / c.spacing_m)
        roomy_m = self.drive.roomy_m
        self._room = self._kernels.centre(self.samples, hits, c.beside_m, roomy_m, c.max_shift_m, line_up)

    def speed_limit_mps(self) -> float:
        """The speed from which all that is ahead can be driven: obstacles, bends, gaps to line up with."""
        c, d = self.config, self.drive
        limit = self._kernels.speed_limit(
            self.samples, self._room, c.spacing_m, d.top_mps, d.slow_mps, d.near_m, d.roomy_m, d.turn_radps,
            d.braking_mps2,
        )  # fmt: skip
        gap = round(c.gap_ahead_m / c.spacing_m)
        aligned = self._kernels.alignment(self.samples, self._room, d.tight_m, gap)
        return min(limit, d.slow_mps + (d.top_mps - d.slow_mps) * aligned)

    def aim(self, hits: Points, nearest_m: float, farthest_m: float, room_m: float) -> tuple[float, float]:
        """The farthest sample within bounds to which a straight line keeps room_m, or what the way has."""
        c = self.config
        soon = self._room[: round(farthest_m / c.spacing_m) + 1, self._kernels.NEAREST]
        need_m = min(room_m, float(soon.min()) - SPARE_M)
        j = self._kernels.farthest_aim(self.samples, hits, c.spacing_m, nearest_m, farthest_m, need_m)
        return float(self.samples[j, 0]), float(self.samples[j, 1])
