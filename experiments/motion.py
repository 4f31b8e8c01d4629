"""How the robot moved: how fast, how straight, how often back over the map, how much of it in vain."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from experiments.planar import travelled_m
from occmap.goals import SAME_GOAL_M

if TYPE_CHECKING:
    from experiments.episode import Step
    from experiments.planar import Poses
    from occmap.goals import Goal

STRETCH_M = 1.0
"""A direction of travel is that of a stretch this long: shorter ones show how a bend is driven."""
REVERSAL_RAD = 0.5 * math.pi
CROSSING_SHARE = 0.5
"""A drive to one goal over more than this share of the map's longer side crosses the map."""


@dataclass(frozen=True)
class Motion:
    """The field `motion` of summary.json."""

    mean_speed_mps: float
    turning_rad: float
    """All turning added up, to the left or to the right."""
    reversals: int
    """How often the direction of travel changed by more than 90 degrees from one metre to the next."""
    crossings: int
    """Drives to one goal that led over more than half of what the whole path spans."""
    abandoned_share: float
    """Of the metres driven, those to goals that were left for others while their frontier was still there."""


@dataclass(frozen=True)
class Drive:
    """Metres driven towards one goal."""

    length_m: float
    is_abandoned: bool


class DriveLog:
    """A recorder of drives: how long each was, and whether its goal was left for another."""

    def __init__(self) -> None:
        self.drives: list[Drive] = []
        self._goal: Goal | None = None
        self._switches = 0
        self._begun_m = 0.0

    def record(self, step: Step) -> None:
        """Note a drive if its goal is no longer the goal."""
        goal, before = step.decision.goal, self._goal
        if before is not None and (goal is None or goal.distance_m(before) > SAME_GOAL_M):
            is_left = step.decision.goal_switches > self._switches
            self.drives.append(Drive(step.truth.path_length_m - self._begun_m, is_left))
            before = None
        if before is None:
            self._begun_m = step.truth.path_length_m
        self._goal, self._switches = goal, step.decision.goal_switches

    def close(self) -> None:
        """Nothing to finish."""


def motion(true: Poses, drives: list[Drive], path_length_m: float, time_s: float) -> dict[str, float]:
    """The figures of a run, from its true poses scan by scan, its drives, its length and its end."""
    turns_rad = np.diff(np.unwrap(true[:, 2]))
    span_m = float(np.ptp(true[:, :2], axis=0).max())
    abandoned_m = sum(drive.length_m for drive in drives if drive.is_abandoned)
    return asdict(
        Motion(
            mean_speed_mps=path_length_m / time_s if time_s > 0.0 else 0.0,
            turning_rad=float(np.abs(turns_rad).sum()),
            reversals=int(np.count_nonzero(np.abs(bends_rad(true[:, :2])) > REVERSAL_RAD)),
            crossings=sum(drive.length_m > max(CROSSING_SHARE * span_m, STRETCH_M) for drive in drives),
            abandoned_share=abandoned_m / path_length_m if path_length_m > 0.0 else 0.0,
        )
    )


def bends_rad(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) the change of direction from each stretch of STRETCH_M along places (n, 2) to the next."""
    along_m = travelled_m(places)
    joints = np.searchsorted(along_m, np.arange(0.0, along_m[-1], STRETCH_M))
    dx, dy = np.diff(places[joints], axis=0).T
    headings = np.arctan2(dy, dx)
    return np.angle(np.exp(1j * np.diff(headings)))
