"""The robot's own time: it goes on, whatever the clock of its observations does."""

from __future__ import annotations

CAUGHT_UP_SHARE = 0.5
"""Of a period: a clock that was made to tick has caught up once it is ahead of those ticks by more."""


class SteadyClock:
    """Reads stamps as times each of which is later than the one before.

    A clock that is set back, or a log that is played again, goes on where it was. One that stands, because
    nobody sets its stamps or they are too coarse, is taken to tick once a period until it has caught up.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last: tuple[float, float] | None = None  # the stamp, and the time that it was read as
        self._late_s = 0.0  # added to stamps
        self._lead_s = 0.0  # by which a stamp must be ahead of the time read last to count

    def read(self, stamp_s: float) -> float:
        """The time of the next observation, given its stamp."""
        now_s = stamp_s + self._late_s
        if self._last is not None:
            last_stamp_s, last_s = self._last
            goes_on = now_s > last_s + self._lead_s
            self._lead_s = 0.0 if goes_on else CAUGHT_UP_SHARE * self._period_s
            now_s = now_s if goes_on else last_s + self._period_s
            if stamp_s < last_stamp_s:
                self._late_s = now_s - stamp_s
        self._last = stamp_s, now_s
        return now_s
