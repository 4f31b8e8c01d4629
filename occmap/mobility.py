"""Whether the robot moves when it is told to, and what to do when it does not."""

from __future__ import annotations

import math

from occmap.body import Body
from occmap.geometry import Twist2
from occmap.recovery import MapClearance, Recovery, RecoveryConfig
from occmap.scan import Observation
from occmap.stuck import StuckConfig, StuckDetector

ASK_EVERY_S = 0.5
"""It takes seconds to tell that the robot is stuck: no need to ask at every scan."""


class Mobility:
    """Watches over the robot's motion and tries manoeuvres to free it, until none is left.

    Incidents that follow one another closely are one series, and a series has only so many attempts;
    once the robot has driven freely for a while, all is forgiven.
    """

    def __init__(
        self,
        stuck: StuckConfig | None = None,
        recovery: RecoveryConfig | None = None,
        body: Body | None = None,
    ) -> None:
        self.detector = StuckDetector(stuck)
        self.recovery = Recovery(recovery, body)
        self.is_hopeless = False
        self._asked_s = -math.inf
        self._free_s = 0.0  # driven since the last manoeuvre
        self._last: Observation | None = None

    @property
    def attempts(self) -> int:
        """Manoeuvres tried in this series of incidents."""
        return self.recovery.attempts

    def measured_twist(self, seen: Observation) -> Twist2:
        """The robot's own motion, as its odometry has it since the last scan."""
        last = self._last
        if last is None or seen.time_s <= last.time_s:
            return Twist2.zero()
        moved = last.odom_from_robot.inverse() @ seen.odom_from_robot
        dt_s = seen.time_s - last.time_s
        return Twist2(moved.x_m / dt_s, moved.yaw_rad / dt_s)

    def manoeuvre(self, seen: Observation, map_clearance: MapClearance) -> Twist2 | None:
        """The twist that may free the robot; None if it is not stuck, or if all has been tried."""
        twist = self.recovery.twist(seen, map_clearance)
        if twist is not None or not self._is_stuck(seen):
            return twist
        if self.recovery.is_exhausted:
            self.is_hopeless = True
            return None
        self.recovery.begin(seen, self.detector.last_twist)
        self.detector.reset()
        self._free_s = 0.0
        return self.recovery.twist(seen, map_clearance)

    def remember(self, seen: Observation, twist: Twist2) -> None:
        """Note the twist that is about to be commanded."""
        self.detector.remember(seen, twist)
        if self._last is not None and twist != Twist2.zero() and not self.recovery.is_under_way(seen.time_s):
            self._free_s += seen.time_s - self._last.time_s
        if self._free_s >= self.recovery.config.forgive_after_s:
            self.recovery.forgive()
        self._last = seen

    def _is_stuck(self, seen: Observation) -> bool:
        if seen.time_s - self._asked_s < ASK_EVERY_S:
            return False
        self._asked_s = seen.time_s
        return self.detector.is_stuck(seen)
