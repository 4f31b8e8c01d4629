"""Where the robot was and where it believed to be, scan by scan."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2

if TYPE_CHECKING:
    from experiments.episode import Step

Poses = NDArray[np.float64]
"""(n, 3) x (m), y (m), yaw (rad)."""


class TrajectoryLog:
    """A recorder that keeps the true and the believed pose of every scan, both in `world`."""

    def __init__(self, world_from_map: Pose2) -> None:
        self._world_from_map = world_from_map
        self._times_s, self._true, self._believed = array("d"), array("d"), array("d")

    def record(self, step: Step) -> None:
        """Note the two poses of this scan."""
        true, believed = step.truth.world_from_robot, self._world_from_map @ step.decision.map_from_robot
        self._times_s.append(step.truth.time_s)
        self._true.extend((true.x_m, true.y_m, true.yaw_rad))
        self._believed.extend((believed.x_m, believed.y_m, believed.yaw_rad))

    def close(self) -> None:
        """Nothing to finish."""

    @property
    def true(self) -> Poses:
        """(n, 3) the true poses."""
        return np.array(self._true).reshape(-1, 3)

    @property
    def believed(self) -> Poses:
        """(n, 3) the robot's estimate of them, placed in the world by the true start."""
        return np.array(self._believed).reshape(-1, 3)

    def write(self, truth_file: Path, estimate_file: Path) -> None:
        """Both as TUM files, one line per scan."""
        truth_file.write_text(tum(self._times_s, self.true))
        estimate_file.write_text(tum(self._times_s, self.believed))


def absolute_error_m(true: Poses, believed: Poses) -> float:
    """Absolute trajectory error: the root mean square distance between the two, nothing fitted."""
    return float(np.sqrt(np.mean(np.sum((true[:, :2] - believed[:, :2]) ** 2, axis=1))))


def drift_per_m(true: Poses, believed: Poses) -> float:
    """Relative error gathered per metre travelled: the mean over all stretches of one metre of true path.

    Each stretch begins at a scan and ends at the first scan at least 1 m further along. 0 for a
    path shorter than that. Unlike the error at the end it does not vanish when the path closes.
    """
    steps_m = np.hypot(*np.diff(true[:, :2], axis=0).T)
    travelled_m = np.concatenate(([0.0], np.cumsum(steps_m)))
    ends = np.searchsorted(travelled_m, travelled_m + 1.0)
    begins = np.flatnonzero(ends < len(true))
    if not len(begins):
        return 0.0
    ends = ends[begins]
    error_m = motion(true, begins, ends) - motion(believed, begins, ends)
    return float(np.mean(np.hypot(*error_m.T) / (travelled_m[ends] - travelled_m[begins])))


def motion(poses: Poses, begins: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.float64]:
    """(k, 2) where each end lies, seen from its beginning."""
    dx, dy = (poses[ends, :2] - poses[begins, :2]).T
    c, s = np.cos(poses[begins, 2]), np.sin(poses[begins, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx))


def tum(times_s: Iterable[float], poses: Poses) -> str:
    """Lines of `t x y z qx qy qz qw`, as the TUM benchmark and `evo` read them."""
    lines = [
        f"{t:.6f} {x:.9f} {y:.9f} 0 0 0 {math.sin(yaw / 2):.12f} {math.cos(yaw / 2):.12f}\n"
        for t, (x, y, yaw) in zip(times_s, poses, strict=True)
    ]
    return "".join(lines)
