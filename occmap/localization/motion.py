"""What the wheels say about the step from one scan to the next, and how far to believe them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from occmap.config_checks import Positive
from occmap.geometry import Pose2, wrap_angle
from occmap.localization.wheel_scale import WheelScale, WheelScaleConfig
from occmap.scan import Observation

DEAF_SIGMAS = 3.0
"""A step by more standard deviations than this, while odometry stands, says that there is none."""
SIGMAS = 3.0
"""A search looks so many standard deviations to every side, if its window may be as wide."""
MOST_SIGMAS = 10.0
"""By so many at most a single step counts as off, however wrong it was."""


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
    """Without odometry, or with wheels that err by more: standard deviation of a step from the last one."""
    blind_sigma_rad: float = 0.10
    """The same, of its turn."""
    blind_mps2: float = 0.5
    """It grows with the square of the time between scans: robots speed up and slow down. That of the turn,
    too, by as many rad/s^2."""
    pause_s: float = 2.0
    """After so long without a scan, the way that was driven need not be the straight step of odometry."""
    pause_mps: float = 0.3
    """If the robot has moved at all in it, it is taken to have driven this fast."""
    gap_window_m: float = 3.0
    """A step that is known too little for its window is searched so far round."""
    leap_m: float = 1.0
    """Wheels that claim more than this at once, and more than a robot drives in the time, count anew."""
    leap_mps: float = 4.0
    """No robot drives faster."""
    leap_rad: float = 1.0
    """Nor do they turn farther than this at once, and faster than a robot turns."""
    leap_radps: float = 6.0
    """No robot turns faster."""
    least_step_m: float = 0.02
    """Shorter steps do not tell how wheels err."""
    memory: int = 30
    """Steps over which the wheels' errors are averaged, to tell how far to believe them."""
    most_distrust: float = 6.0
    """The standard deviations of wheels that err more are multiplied, but by no more than this."""
    scale: WheelScaleConfig = field(default_factory=WheelScaleConfig)


@dataclass(frozen=True)
class Prediction:
    """A step expected before the scan is looked at."""

    step: Pose2  # previous_robot_from_robot
    sigma_m: float
    sigma_rad: float
    window_m: float
    window_rad: float
    is_gap: bool = False
    """The robot may be where nothing is seen of what was seen last."""
    most_m: float = math.inf
    """No robot has come farther off this step since the last scan that fitted."""
    most_rad: float = math.inf
    """Nor turned farther."""

    def surprise(self, guess: Pose2, found: Pose2) -> float:
        """How far a pose is off the one predicted, squared, in standard deviations."""
        off_m, off_rad = found.distance_to(guess), wrap_angle(found.yaw_rad - guess.yaw_rad)
        return (off_m / self.sigma_m) ** 2 + (off_rad / self.sigma_rad) ** 2


@dataclass
class Distrust:
    """How many of their expected standard deviations wheels err by."""

    mean_square: float = 1.0

    def learn(self, sigmas: float, memory: int) -> None:
        """Take in that one more step was off by so many."""
        self.mean_square += (min(sigmas * sigmas, MOST_SIGMAS**2) - self.mean_square) / memory

    def factor(self, most: float) -> float:
        """What to multiply standard deviations by: never less than 1."""
        return min(math.sqrt(max(self.mean_square, 1.0)), most)


class MotionModel:
    """Predicts a step from odometry; from the last step if that says nothing while scans see the robot move.

    How far wheels are believed follows from how they did of late, as far as scans could tell
    (innovation-based adaptive estimation, Mehra 1972).
    """

    def __init__(self, config: MotionConfig) -> None:
        self.config = config
        self._odometry_moves = False
        self._is_deaf = False  # the robot has moved, and no odometry has ever said so
        self._last: Observation | None = None
        self._last_step = Pose2.identity()
        self._expected: tuple[Pose2, float, float] | None = None  # the wheels' step and its deviations
        self._distrust_m, self._distrust_rad = Distrust(), Distrust()
        self._scale = WheelScale(config.scale)
        self._claimed_m = 0.0  # by the wheels in the last step, forward
        self._lost_s = 0.0  # since the last scan that fitted
        self.step_s = 0.0
        """Seconds from the last observation but one to the last."""

    def predict(self, seen: Observation) -> Prediction:
        """The step expected since the last observation, (0, 0, 0) for the first."""
        prediction = self._expect(seen)
        self._lost_s += self.step_s
        c = self.config
        return replace(prediction, most_m=c.leap_mps * self._lost_s, most_rad=c.leap_radps * self._lost_s)

    def _expect(self, seen: Observation) -> Prediction:
        step = (
            Pose2.identity()
            if self._last is None
            else self._last.odom_from_robot.inverse() @ seen.odom_from_robot
        )
        self.step_s = 0.0 if self._last is None else max(seen.time_s - self._last.time_s, 0.0)
        self._last = seen
        self._odometry_moves |= step != Pose2.identity()
        self._is_deaf &= not self._odometry_moves
        self._expected, blind = None, self._blind()
        if self._is_deaf or self._is_leap(step) or (blind.is_gap and not self._odometry_moves):
            return blind
        self._claimed_m = step.x_m
        expected = self._by_wheels(self._scale.corrected(step))
        if self._odometry_moves:
            return expected
        return replace(expected, window_m=blind.window_m, window_rad=blind.window_rad)  # it may say nothing

    def _is_leap(self, step: Pose2) -> bool:
        """Whether a step is none that a robot can take."""
        c = self.config
        too_far = math.hypot(step.x_m, step.y_m) > c.leap_m + c.leap_mps * self.step_s
        return too_far or abs(step.yaw_rad) > c.leap_rad + c.leap_radps * self.step_s

    def _blind(self) -> Prediction:
        """The last step once more; after a pause, the robot may have driven anywhere."""
        c = self.config
        if self.step_s > c.pause_s:
            driven_m = c.pause_mps * self.step_s
            sigma_m, sigma_rad = c.blind_sigma_m + driven_m, min(c.blind_sigma_rad + driven_m, math.pi)
            window_m, window_rad = min(SIGMAS * sigma_m, c.gap_window_m), min(SIGMAS * sigma_rad, math.pi)
            return Prediction(Pose2.identity(), sigma_m, sigma_rad, window_m, window_rad, is_gap=True)
        sigma_m, sigma_rad = c.blind_sigma_m, c.blind_sigma_rad
        return Prediction(self._last_step, sigma_m, sigma_rad, SIGMAS * sigma_m, SIGMAS * sigma_rad)

    def _by_wheels(self, step: Pose2) -> Prediction:
        """What the wheels say, believed as far as they have earned it."""
        c = self.config
        metres, turn = math.hypot(step.x_m, step.y_m), abs(step.yaw_rad)
        if self.step_s > c.pause_s and max(metres, turn) > c.least_step_m:
            metres = max(metres, c.pause_mps * self.step_s)
        root = math.sqrt(max(metres, 1.0))  # errors of many metres average out
        sigma_m = c.sigma_m + c.sigma_m_per_m * metres
        sigma_rad = c.sigma_rad + c.sigma_rad_per_rad * turn + c.sigma_rad_per_m * metres / root
        self._expected = step, sigma_m, sigma_rad
        step, sigma_m, sigma_rad = self._distrusted(step, sigma_m, sigma_rad, root)
        is_gap = SIGMAS * sigma_m > c.max_window_m
        window_m = max(c.window_m + c.window_m_per_m * metres, SIGMAS * sigma_m)
        window_rad = c.window_rad + c.window_rad_per_rad * turn + c.window_rad_per_m * metres
        return Prediction(
            step,
            sigma_m,
            sigma_rad,
            min(window_m, c.gap_window_m if is_gap else c.max_window_m),
            min(max(window_rad, SIGMAS * sigma_rad), c.max_window_rad),
            is_gap,
        )

    def _distrusted(
        self, step: Pose2, sigma_m: float, sigma_rad: float, root: float
    ) -> tuple[Pose2, float, float]:
        """Step and standard deviations, of wheels that erred as these did of late.

        If they say less than that robots go on as they went, that is what the robot is taken to have done.
        """
        c, blind = self.config, self._blind()
        most_m = max(blind.sigma_m + 0.5 * c.blind_mps2 * self.step_s**2, sigma_m)
        most_rad = max(blind.sigma_rad + 0.5 * c.blind_mps2 * self.step_s**2, sigma_rad)
        sigma_m *= 1.0 + (self._distrust_m.factor(c.most_distrust) - 1.0) / root
        sigma_rad *= 1.0 + (self._distrust_rad.factor(c.most_distrust) - 1.0) / root
        if sigma_m > most_m:
            step, sigma_m = Pose2(blind.step.x_m, blind.step.y_m, step.yaw_rad), most_m
        if sigma_rad > most_rad:
            step, sigma_rad = Pose2(step.x_m, step.y_m, blind.step.yaw_rad), most_rad
        return step, sigma_m, sigma_rad

    @property
    def last(self) -> Observation | None:
        """The observation predicted last."""
        return self._last

    def rest_until(self, time_s: float) -> None:
        """After a pause in which the robot stood: odometry goes on, and none of that time was driven in."""
        if self._last is not None and time_s - self._last.time_s > self.config.pause_s:
            self._last, self._last_step = replace(self._last, time_s=time_s), Pose2.identity()

    def forget_odometry(self) -> None:
        """Odometry begins anew, or there is none from now on: the robot is taken to be where it was."""
        self._last, self._last_step = None, Pose2.identity()
        self._odometry_moves = self._is_deaf = False

    def took(self, step: Pose2, is_seen: bool = True, fits: bool = True) -> None:
        """What the step turned out to be; is_seen if the scan says so, and not just the prediction; fits if
        the scan at least shows nothing else.
        """
        c, expected, self._last_step = self.config, self._expected, step
        self._lost_s = 0.0 if fits else self._lost_s
        if expected is None:
            return
        by_wheels, sigma_m, sigma_rad = expected
        off = by_wheels.inverse() @ step
        sigmas, turn_sigmas = math.hypot(off.x_m, off.y_m) / sigma_m, abs(off.yaw_rad) / sigma_rad
        if not self._odometry_moves:
            self._is_deaf = max(sigmas, turn_sigmas) > DEAF_SIGMAS
        elif is_seen and math.hypot(step.x_m, step.y_m) >= c.least_step_m:
            self._scale.learn(self._claimed_m, step.x_m)
            self._distrust_m.learn(sigmas, c.memory)
            self._distrust_rad.learn(turn_sigmas, c.memory)
