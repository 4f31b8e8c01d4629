"""What the wheels say about the step from one scan to the next, and how far to believe them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from occmap.geometry import Pose2
from occmap.localization.positive import Positive
from occmap.scan import Observation


@dataclass(frozen=True)
class MotionConfig(Positive):
    """Odometry is believed as far as these say, and searched around as far as the windows reach."""

    sigma_m: float = 0.01
    """Standard deviation of a step's translation, whatever its length."""
    sigma_m_per_m: float = 0.10
    """And of a metre travelled."""
    sigma_rad: float = 0.006
    """Standard deviation of a step's turn."""
    sigma_rad_per_rad: float = 0.10
    """And of a radian turned."""
    sigma_rad_per_m: float = 0.05
    """And of a metre travelled."""
    window_m: float = 0.05
    """The search looks at least this far to every side."""
    window_m_per_m: float = 2.5
    """And so far for a metre travelled: more than 2, because some wheels count backwards as forwards."""
    window_rad: float = 0.02
    """The search turns at least this far either way."""
    window_rad_per_rad: float = 0.5
    """And so far for a radian turned."""
    window_rad_per_m: float = 0.2
    """And so far for a metre travelled."""
    max_window_m: float = 0.8
    """But never farther, so as not to hold up the robot. A scan that then fits badly gets a second look."""
    max_window_rad: float = 0.6
    """And never turns farther."""
    blind_sigma_m: float = 0.15
    """Without odometry: standard deviation of a step from the last one repeated."""
    blind_sigma_rad: float = 0.10
    """The same, of its turn."""


@dataclass(frozen=True)
class Prediction:
    """A step expected before the scan is looked at."""

    step: Pose2  # previous_robot_from_robot
    sigma_m: float
    sigma_rad: float
    window_m: float
    window_rad: float


class MotionModel:
    """Predicts a step from odometry; from the last step if odometry has never moved."""

    def __init__(self, config: MotionConfig) -> None:
        self.config = config
        self._odometry_moves = False
        self._last: Observation | None = None
        self._last_step = Pose2.identity()
        self.step_s = 0.0
        """Seconds from the last observation but one to the last."""

    def predict(self, seen: Observation) -> Prediction:
        c = self.config
        step = (
            Pose2.identity()
            if self._last is None
            else self._last.odom_from_robot.inverse() @ seen.odom_from_robot
        )
        self.step_s = 0.0 if self._last is None else seen.time_s - self._last.time_s
        self._last = seen
        self._odometry_moves |= step != Pose2.identity()
        if not self._odometry_moves:
            window_m, window_rad = 3.0 * c.blind_sigma_m, 3.0 * c.blind_sigma_rad
            return Prediction(self._last_step, c.blind_sigma_m, c.blind_sigma_rad, window_m, window_rad)
        metres, turn = math.hypot(step.x_m, step.y_m), abs(step.yaw_rad)
        sigma_m = c.sigma_m + c.sigma_m_per_m * metres
        sigma_rad = c.sigma_rad + c.sigma_rad_per_rad * turn + c.sigma_rad_per_m * metres
        window_m = max(c.window_m + c.window_m_per_m * metres, 3.0 * sigma_m)
        window_rad = c.window_rad + c.window_rad_per_rad * turn + c.window_rad_per_m * metres
        window_rad = max(window_rad, 3.0 * sigma_rad)
        return Prediction(
            step, sigma_m, sigma_rad, min(window_m, c.max_window_m), min(window_rad, c.max_window_rad)
        )

    @property
    def last(self) -> Observation | None:
        """The observation predicted last."""
        return self._last

    def forget_odometry(self) -> None:
        """Odometry begins anew, or there is none from now on: the robot is taken to be where it was."""
        self._last, self._last_step, self._odometry_moves = None, Pose2.identity(), False

    def took(self, step: Pose2) -> None:
        """What the step turned out to be."""
        self._last_step = step
