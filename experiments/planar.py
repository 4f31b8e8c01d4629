"""Poses and places of the plane, many at once, a row each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Points

Poses = NDArray[np.float64]
"""(n, 3) x (m), y (m), yaw (rad)."""


def between(begin: Poses, end: Poses) -> Poses:
    """(n, 3) begin^-1 @ end, row by row."""
    dx, dy = (end[:, :2] - begin[:, :2]).T
    c, s = np.cos(begin[:, 2]), np.sin(begin[:, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, wrapped(end[:, 2] - begin[:, 2])))


def wrapped(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angles in (-pi, pi]."""
    return np.pi - (np.pi - angle_rad) % (2.0 * np.pi)


def travelled_m(places: Points) -> NDArray[np.float64]:
    """(n,) metres along a path (n, 2) from its beginning to each of its places."""
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))))
