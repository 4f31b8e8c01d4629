"""Where the robot was and where it believed to be, scan by scan."""

from __future__ import annotations

from array import array
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.planar import Poses, between, travelled_m
from experiments.tum_file import tum
from occmap.geometry import Pose2

if TYPE_CHECKING:
    from experiments.episode import Step


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
    along_m = travelled_m(true[:, :2])
    ends = np.searchsorted(along_m, along_m + 1.0)
    begins = np.flatnonzero(ends < len(true))
    if not len(begins):
        return 0.0
    ends = ends[begins]
    moved, believed_moved = (between(poses[begins], poses[ends]) for poses in (true, believed))
    error_m = (moved - believed_moved)[:, :2]
    return float(np.mean(np.hypot(*error_m.T) / (along_m[ends] - along_m[begins])))
