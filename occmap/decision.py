"""What the explorer says each time it is asked: values that flow out of `Explorer.decide`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from occmap.frontiers import Frontier
from occmap.geometry import Pose2, Twist2

if TYPE_CHECKING:
    from occmap.goals import Goal
    from occmap.planner import Path


class Status(Enum):
    """Whether the robot goes on, and if not, why."""

    EXPLORING = "exploring"
    COMPLETE = "complete"
    """Nothing reachable is left to see."""
    SEALED_IN = "sealed_in"
    """Nothing reachable is left to see, and free space that was once reachable no longer is."""
    STUCK = "stuck"
    """The wheels turn, the robot does not, and no manoeuvre freed it."""


class Reason(Enum):
    """Why a frontier is left unseen."""

    TOO_NARROW = "too_narrow"
    """Free space leads to it, but the body does not fit through, and nowhere it can stand looks in, unless
    that is far from there and not worth the way."""
    SEALED = "sealed"
    """No free space leads to it: seen through glass, over a wall or by a stray beam."""
    SPECK = "speck"
    """Too short to be worth a look, or hiding too little to be worth the way."""
    UNSAFE = "unsafe"
    """Each approach was broken off because an obstacle came too close."""
    GAVE_UP = "gave_up"
    """Looked at from near in vain, or pursued without learning anything, or turned back from again and
    again."""
    OUTSIDE = "outside"
    """Beyond the boundary that the robot was given."""
    UNVISITED = "unvisited"
    """In reach and worth a look: the run ended before its turn came. Never left by a run that is complete."""


@dataclass(frozen=True, slots=True)
class UnknownLeft:
    """One line of the certificate of being done: a frontier that remains, and why."""

    in_map: tuple[float, float]  # centroid, m
    size_m: float  # length of the frontier: cells times resolution
    reason: Reason
    why: str  # for a person


@dataclass(frozen=True, slots=True)
class Decision:
    """What the robot does until its next scan, and what it has in mind."""

    status: Status
    twist: Twist2
    map_from_robot: Pose2
    activity: str
    """exploring, looking, thinking, recovering, blind, lost or the final status: for a state timeline."""
    goal: Goal | None
    path: Path | None
    frontiers: tuple[Frontier, ...]
    unknown_left: tuple[UnknownLeft, ...]
    """Filled when the robot has ended: each remaining frontier with its reason."""
    events: tuple[str, ...]
    """What was decided since the last scan, in words."""
    replans: int
    """Paths planned so far."""
    goal_switches: int
    """Goals abandoned for others so far while their frontier was still there."""
    stage_s: Mapping[str, float]
    """Wall seconds spent in this decision: localization, mapping, frontiers, planning."""
