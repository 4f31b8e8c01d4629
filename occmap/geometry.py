"""Poses and twists in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
"""(n, 2) positions in metres."""


def wrap_angle(angle_rad: float) -> float:
    """The same angle in (-pi, pi]."""
    return math.pi - (math.pi - angle_rad) % (2.0 * math.pi)


@dataclass(frozen=True, slots=True)
class Pose2:
    """A rigid transform of the plane, an element of SE(2).

    Named `a_from_b`, it takes coordinates in frame b to coordinates in frame a, and is equally
    the pose of b seen from a. Neighbours meet: `a_from_c = a_from_b @ b_from_c`. Yaw is counter-clockwise;
    products and inverses have it in (-pi, pi]. ValueError if a number is not finite.
    """

    x_m: float
    y_m: float
    yaw_rad: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.x_m) and math.isfinite(self.y_m) and math.isfinite(self.yaw_rad)):
            raise ValueError(f"a pose must be finite, got x={self.x_m}, y={self.y_m}, yaw={self.yaw_rad}")

    @staticmethod
    def identity() -> Pose2:
        """The pose of a frame in itself."""
        return Pose2(0.0, 0.0, 0.0)

    def __matmul__(self, other: Pose2) -> Pose2:
        """a_from_b @ b_from_c = a_from_c."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2(
            self.x_m + c * other.x_m - s * other.y_m,
            self.y_m + s * other.x_m + c * other.y_m,
            wrap_angle(self.yaw_rad + other.yaw_rad),
        )

    def inverse(self) -> Pose2:
        """b_from_a of a_from_b."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2(
            -c * self.x_m - s * self.y_m,
            s * self.x_m - c * self.y_m,
            wrap_angle(-self.yaw_rad),
        )

    def apply(self, points: Points) -> Points:
        """Points (n, 2) of the right-hand frame, in the left-hand one."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        x, y = points[:, 0], points[:, 1]
        return np.column_stack((self.x_m + c * x - s * y, self.y_m + s * x + c * y))

    def distance_to(self, other: Pose2) -> float:
        """Metres between the two origins."""
        return math.hypot(other.x_m - self.x_m, other.y_m - self.y_m)

    def numbers(self) -> tuple[float, float, float]:
        """x_m, y_m and yaw_rad, as kernels take them: whoever made the pose may have written integers."""
        return float(self.x_m), float(self.y_m), float(self.yaw_rad)

    @property
    def position(self) -> tuple[float, float]:
        """(x, y) in metres."""
        return self.x_m, self.y_m


@dataclass(frozen=True, slots=True)
class Twist2:
    """Velocity of a differential drive in its own frame: forward (m/s) and counter-clockwise (rad/s).

    ValueError if a number is not finite.
    """

    linear_mps: float
    angular_radps: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.linear_mps) and math.isfinite(self.angular_radps)):
            raise ValueError(f"a twist must be finite, got v={self.linear_mps}, w={self.angular_radps}")

    @staticmethod
    def zero() -> Twist2:
        """Standstill."""
        return Twist2(0.0, 0.0)
