"""Whether the robot moves when it is told to, and what to do when it does not."""

from __future__ import annotations

import math

from occmap.geometry import Twist2
from occmap.recovery import Recovery, RecoveryConfig
from occmap.scan import Observation
from occmap.stuck import StuckConfig, StuckDetector

ASK_EVERY_S = 0.5
"""It takes seconds to tell that the robot is stuck: no need to ask at every scan."""


class Mobility:
    """Watches over the robot's motion and tries manoeuvres to free it, until none is left."""

    def __init__(self, stuck: StuckConfig | None = None, recovery: RecoveryConfig | None = None) -> None:
        self.detector = StuckDetector(stuck)
        self.recovery = Recovery(recovery)
        self.is_hopeless = False
        self._asked_s = -math.inf

    def remember(self, seen: Observation, twist: Twist2) -> None:
        """Note the twist that is about to be commanded."""
        self.detector.remember(seen, twist)

    def manoeuvre(self, seen: Observation) -> Twist2 | None:
        """What frees the robot; None if it is not stuck, or if all has been tried."""
        twist = self.recovery.twist(seen.time_s)
        if twist is not None or not self._is_stuck(seen):
            return twist
        if self.recovery.is_exhausted:
            self.is_hopeless = True
            return None
        self.recovery.begin(seen.time_s, self.detector.last_twist, seen.scan)
        self.detector.reset()
        return self.recovery.twist(seen.time_s)

    def _is_stuck(self, seen: Observation) -> bool:
        if seen.time_s - self._asked_s < ASK_EVERY_S:
            return False
        self._asked_s = seen.time_s
        return self.detector.is_stuck(seen)
