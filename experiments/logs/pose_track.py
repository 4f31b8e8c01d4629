"""Poses at stamps, and in between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2, wrap_angle


class PoseTrack:
    """A pose as a function of time: linear between its samples, constant before and after them."""

    def __init__(self, times_s: list[float], poses: list[Pose2]) -> None:
        if not times_s or len(times_s) != len(poses):
            raise ValueError(
                f"a track needs one pose a stamp, got {len(times_s)} stamps and {len(poses)} poses"
            )
        order = np.argsort(times_s, kind="stable")
        self._times_s: NDArray[np.float64] = np.asarray(times_s, np.float64)[order]
        self._poses = [poses[k] for k in order]

    def at(self, time_s: float) -> Pose2:
        """The pose at a time; its heading turns the shorter way round."""
        after = int(np.searchsorted(self._times_s, time_s, side="right"))
        if after == 0:
            return self._poses[0]
        if after == len(self._poses):
            return self._poses[-1]
        a, b = self._poses[after - 1], self._poses[after]
        begin_s, end_s = self._times_s[after - 1 : after + 1].tolist()
        part = (time_s - begin_s) / (end_s - begin_s)
        return Pose2(
            a.x_m + part * (b.x_m - a.x_m),
            a.y_m + part * (b.y_m - a.y_m),
            wrap_angle(a.yaw_rad + part * wrap_angle(b.yaw_rad - a.yaw_rad)),
        )
