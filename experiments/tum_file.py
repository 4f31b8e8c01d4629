"""Trajectories as TUM files: `t x y z qx qy qz qw` a line, seconds and metres."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.number_rows import read_rows
from experiments.planar import Poses
from occmap.geometry import Pose2


@dataclass(frozen=True)
class Trajectory:
    """Poses in the plane at stamps, in the order of their stamps."""

    times_s: NDArray[np.float64]  # (n,)
    poses: Poses  # (n, 3) x (m), y (m), yaw (rad)

    def __post_init__(self) -> None:
        if self.poses.shape != (len(self.times_s), 3):
            raise ValueError(f"{len(self.times_s)} stamps need as many poses, got shape {self.poses.shape}")

    def __len__(self) -> int:
        return len(self.times_s)

    @staticmethod
    def of(times_s: list[float], poses: list[Pose2]) -> Trajectory:
        """Of stamps in any order."""
        rows = np.array([(pose.x_m, pose.y_m, pose.yaw_rad) for pose in poses], np.float64).reshape(-1, 3)
        order = np.argsort(times_s, kind="stable")
        return Trajectory(np.array(times_s, np.float64)[order], rows[order])

    def nearest(self, times_s: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """(k,) which stamp is nearest to each time, and how far it is from it (s)."""
        after = np.clip(np.searchsorted(self.times_s, times_s), 1, max(len(self) - 1, 1))
        before = after - 1
        after = np.minimum(after, len(self) - 1)
        nearer = np.abs(self.times_s[after] - times_s) < np.abs(self.times_s[before] - times_s)
        index = np.where(nearer, after, before)
        return index, np.abs(self.times_s[index] - times_s)


def tum(times_s: Iterable[float], poses: Poses) -> str:
    """Lines of `t x y z qx qy qz qw`, as the TUM benchmark and `evo` read them."""
    lines = [
        f"{t:.6f} {x:.9f} {y:.9f} 0 0 0 {math.sin(yaw / 2):.12f} {math.cos(yaw / 2):.12f}\n"
        for t, (x, y, yaw) in zip(times_s, poses, strict=True)
    ]
    return "".join(lines)


def write_tum(path: Path, trajectory: Trajectory) -> None:
    """One line a pose; `read_tum` reads it back, times to the microsecond."""
    path.write_text(tum(trajectory.times_s.tolist(), trajectory.poses))


def read_tum(path: Path) -> Trajectory:
    """The planar part of a file's poses, sorted by stamp."""
    values = read_rows(path, 8, "TUM trajectory")
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{path} is no TUM trajectory: it must hold finite numbers")
    if not np.allclose(np.linalg.norm(values[:, 4:], axis=1), 1.0, atol=1e-2):
        raise ValueError(f"{path} is no TUM trajectory: the last 4 numbers must be unit quaternions")
    values = values[np.argsort(values[:, 0], kind="stable")]
    x, y, z, w = values[:, 4:].T
    yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return Trajectory(values[:, 0].copy(), np.column_stack((values[:, 1:3], yaw)))
