"""Where a body has been lately."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Trail:
    """The last poses of a free body, to be read between the samples."""

    def __init__(self) -> None:
        self.keep_s = 0.0
        """How far back it can be read: whoever does says so beforehand."""
        self._samples: deque[tuple[float, list[float]]] = deque()
        self._has_forgotten = False

    def record(self, time_s: float, qpos: list[float]) -> None:
        """Keep one sample: position (x, y, z), orientation (w, x, y, z) and whatever follows them."""
        self._samples.append((time_s, qpos))
        while len(self._samples) > 2 and self._samples[1][0] <= time_s - self.keep_s:
            self._samples.popleft()
            self._has_forgotten = True

    def at(self, times_s: Floats) -> Floats:
        """(n, 3) x, y and yaw at n times; before the first sample of all the body stood where that has it."""
        known_s = [time for time, _ in self._samples]
        if self._has_forgotten and times_s.min() < known_s[0]:
            raise ValueError(f"asked for t = {times_s.min()} s, but the trail keeps only {self.keep_s} s")
        first = max(0, bisect_right(known_s, times_s.min()) - 1)  # nothing older is asked for
        known_s, samples = known_s[first:], list(self._samples)[first:]
        poses = np.array([(pose[0], pose[1], yaw_of(pose)) for _, pose in samples])
        poses[:, 2] = np.unwrap(poses[:, 2])
        return np.column_stack([np.interp(times_s, known_s, poses[:, axis]) for axis in range(3)])


def yaw_of(pose: list[float]) -> float:
    """The heading of a pose of 7 numbers or more, about the vertical."""
    w, x, y, z = pose[3:7]
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
