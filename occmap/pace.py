"""When the explorer thinks again."""

from __future__ import annotations

import math
from dataclasses import dataclass

from occmap.config_checks import NeverNegative
from occmap.pursuit import LEARNT_M2


@dataclass(frozen=True)
class PaceConfig(NeverNegative):
    """When the explorer thinks again."""

    first_look_s: float = 0.5
    """It stands still this long at first: a cell takes a few scans to be believed free."""
    reconsider_s: float = 3.0
    """While a goal is good, its rivals are weighed this often."""
    reconsider_nook_s: float = 10.0
    """A nook has no rivals but other nooks: it is weighed less often."""


class Pace:
    """Remembers when goals were weighed last, and how much was known then."""

    def __init__(self, config: PaceConfig) -> None:
        self.config = config
        self._begun_s: float | None = None
        self._weighed_s = -math.inf
        self._known_m2 = 0.0  # then, at most

    def begin(self, now_s: float) -> None:
        """Take in the time of the first scan; later ones change nothing."""
        if self._begun_s is None:
            self._begun_s = now_s

    def is_first_look(self, now_s: float) -> bool:
        """Whether the robot still stands where it was put, to look around."""
        return self._begun_s is None or now_s - self._begun_s < self.config.first_look_s

    def weigh(self, known_m2: float, now_s: float) -> None:
        """Take in that a goal is being chosen."""
        self._weighed_s, self._known_m2 = now_s, max(self._known_m2, known_m2)

    def is_due(self, known_m2: float, now_s: float, *, is_nook: bool) -> bool:
        """Whether to weigh a good goal, a nook or not, against others.

        Only where something was learnt since: with the map as it was, another choice would be dithering.
        """
        every_s = self.config.reconsider_nook_s if is_nook else self.config.reconsider_s
        return known_m2 >= self._known_m2 + LEARNT_M2 and now_s - self._weighed_s >= every_s

    def forget_the_map(self) -> None:
        """Take in that the map is another one: whatever is known of it is news."""
        self._known_m2 = 0.0
