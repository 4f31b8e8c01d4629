"""Counting how often, and for how long, a robot touches what it should not."""

from __future__ import annotations

import math


class Collisions:
    """Contacts between the robot and anything but the floor, told step by step.

    Bodies chatter when they touch: a contact within `gap_s` of the last one belongs to the same event.
    """

    def __init__(self, step_s: float, gap_s: float = 0.1) -> None:
        self._step_s = step_s
        self._gap_s = gap_s
        self._last_s = -math.inf
        self._steps = 0
        self.events = 0

    @property
    def duration_s(self) -> float:
        """Seconds spent in contact."""
        return self._steps * self._step_s

    def count(self, time_s: float) -> None:
        """The robot touched something in the physics step that ended now."""
        if time_s - self._last_s > self._gap_s:
            self.events += 1
        self._last_s = time_s
        self._steps += 1
