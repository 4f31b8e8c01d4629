"""When exploration is over: no goal is left, and none turns up for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import NeverNegative
from occmap.decision import Status
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.memory import ReachMemory
from occmap.stuck import ROUNDING_S

if TYPE_CHECKING:
    from occmap.planner import Wavefront


@dataclass(frozen=True)
class EndingConfig(NeverNegative):
    """How sure the robot is before it calls itself done."""

    confirm_s: float = 1.0
    """No goal must turn up for this long."""
    again_s: float = 0.5
    """While there is none, one is sought this often: the map hardly changes, and all of it is looked at."""
    survey_s: float = 10.0
    """This often a flood goes farther than the next goal requires: what is in reach is worth remembering."""
    survey_m: float = 16.0
    """How far it goes at least where no goal is sought."""


class Ending:
    """Remembers since when there has been no goal, and where the robot once could go."""

    def __init__(self, config: EndingConfig) -> None:
        self.config = config
        self._reach = ReachMemory()
        self._goalless_since_s: float | None = None
        self._sought_s = -math.inf
        self._surveyed_s = -math.inf

    def carry_over(self, new_map_from_old_map: Pose2, grid: OccupancyGrid) -> None:
        """Follow a correction of the map onto another grid."""
        self._reach.carry_over(new_map_from_old_map, grid)

    def is_survey_due(self, now_s: float) -> bool:
        """Whether to look farther around this time."""
        return now_s - self._surveyed_s >= self.config.survey_s

    def is_search_due(self, now_s: float) -> bool:
        """Whether to look for a goal, given that there is none now."""
        return self._goalless_since_s is None or now_s - self._sought_s >= self.config.again_s - ROUNDING_S

    def begin_again(self) -> None:
        """Forget that there was no goal: it was sought from a place where the robot may not have been."""
        self._goalless_since_s = None

    def survey(self, wave: Wavefront, grid: OccupancyGrid, now_s: float) -> None:
        """Remember what a flood that went farther has reached."""
        self._surveyed_s = now_s
        self._reach.note(wave, grid)

    def note(self, has_goal: bool, wave: Wavefront, grid: OccupancyGrid, now_s: float) -> None:
        """Take in what a search has found, and the flood it has made."""
        self._reach.note(wave, grid)
        self._sought_s = now_s
        if has_goal:
            self._goalless_since_s = None
        elif self._goalless_since_s is None:
            self._goalless_since_s = now_s

    def status(self, wave: Wavefront, grid: OccupancyGrid, roomy: NDArray[np.bool_], now_s: float) -> Status:
        """The end, if it has come; given a flood of all in reach, and where there is space for the body."""
        since_s = self._goalless_since_s
        if since_s is None or now_s - since_s < self.config.confirm_s:
            return Status.EXPLORING
        return Status.SEALED_IN if self._reach.is_cut_off(wave, grid, roomy) else Status.COMPLETE
