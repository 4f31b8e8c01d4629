"""How a run ended."""

from __future__ import annotations

from enum import StrEnum

from occmap.decision import Status


class Outcome(StrEnum):
    """The `status` of a summary; a script tells them apart by `exit_status`."""

    COMPLETE = "complete"
    """Nothing reachable is left to see."""
    SEALED_IN = "sealed_in"
    """The same, but the world has closed: free space once reachable no longer is."""
    TIME_LIMIT = "time_limit"
    """The simulated time ran out first."""
    STUCK = "stuck"
    """The wheels turn, the robot does not, and nothing freed it."""
    PHYSICS_FAULT = "physics_fault"
    """The simulation could no longer be trusted."""
    INTERRUPTED = "interrupted"
    """SIGINT or SIGTERM: the files hold what there was until then."""

    @staticmethod
    def of(status: Status) -> Outcome:
        """What the explorer's last word amounts to; one that was still exploring ran out of time."""
        return Outcome.TIME_LIMIT if status is Status.EXPLORING else Outcome(status.value)

    @property
    def exit_status(self) -> int:
        """0: the map is as complete as it can be. 1 and 2 are left to crashes and users' mistakes."""
        return EXIT_STATUS[self]


EXIT_STATUS = {
    Outcome.COMPLETE: 0,
    Outcome.SEALED_IN: 0,
    Outcome.TIME_LIMIT: 3,
    Outcome.STUCK: 4,
    Outcome.PHYSICS_FAULT: 5,
    Outcome.INTERRUPTED: 130,
}
"""INTERRUPTED by SIGTERM exits with 143 instead."""
