"""What may go wrong in the world, and when."""

from __future__ import annotations

import math
from dataclasses import dataclass


class PhysicsFault(RuntimeError):
    """The simulation is no longer to be trusted: a warning of MuJoCo's, or a state that is not finite."""


@dataclass(frozen=True)
class FaultsConfig:
    """Mishaps by the clock of the simulation. None of them happens by default."""

    close_doors_at_s: float | None = None
    """Doors begin to close at this time; each waits while the robot is in its way."""
    close_doors: tuple[int, ...] = ()
    """Which doors close, by their number in the building; none named: all of them."""
    lift_at_s: float | None = None
    """The body runs onto something and its wheels lose the floor: they turn, it does not move."""
    lift_for_s: float | None = None
    """It slips off again after so long; never, if not given."""
    blind_at_s: float | None = None
    """The lidar's beams all fail from this time on."""
    blind_for_s: float | None = None
    """It recovers after so long; never, if not given."""

    def __post_init__(self) -> None:
        for name in ("close_doors_at_s", "lift_at_s", "lift_for_s", "blind_at_s", "blind_for_s"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be a time of 0 s or later, got {value}")
        if any(number < 0 for number in self.close_doors):
            raise ValueError(f"close_doors must be numbers of doors from 0 on, got {self.close_doors}")
        for begin, detail in (
            ("close_doors_at_s", "close_doors"), ("lift_at_s", "lift_for_s"), ("blind_at_s", "blind_for_s"),
        ):  # fmt: skip
            if getattr(self, begin) is None and getattr(self, detail) not in (None, ()):
                raise ValueError(f"{detail} without {begin} never happens: give both")

    def lifted(self, time_s: float) -> bool:
        """Whether the wheels hang in the air at this time."""
        return _within(time_s, self.lift_at_s, self.lift_for_s)

    def blind(self, time_s: float) -> bool:
        """Whether the lidar is blind at this time."""
        return _within(time_s, self.blind_at_s, self.blind_for_s)


def _within(time_s: float, begin_s: float | None, lasting_s: float | None) -> bool:
    if begin_s is None or time_s < begin_s:
        return False
    return lasting_s is None or time_s < begin_s + lasting_s
