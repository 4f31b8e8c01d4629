"""The window of a correlative search: which poses are tried, and which of them count."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2

TURN, SHIFT_X, SHIFT_Y, SCORE = range(4)
"""Of the best pose of a search: steps of turn, cells of shift, and the sum of raster values that it has."""


@dataclass(frozen=True)
class Window:
    """Poses round a guess: whole steps of turn, and shifts by whole cells of a raster along both axes."""

    guess: Pose2
    half_width_m: float
    half_turn_rad: float
    turn_step_rad: float
    least_score: float = -1.0
    """Poses that score less (mean likelihood, 0 to 1) do not count; the higher, the faster."""
    shun: Pose2 | None = None
    """Nor do those within shun_m of this one."""
    shun_m: float = 0.0
    any_will_do: bool = False
    """The search is over with the first pose that counts, be it the best one or not."""

    @property
    def half_turns(self) -> int:
        """Steps of turn to either side."""
        return math.ceil(self.half_turn_rad / self.turn_step_rad)

    def half_cells(self, cell_m: float) -> int:
        """Shifts to either side."""
        return math.ceil(self.half_width_m / cell_m)

    def shunned(self, cell_m: float) -> NDArray[np.int64]:
        """(3,) shift x, y and radius of what does not count, in cells; a radius of -1 for none."""
        if self.shun is None:
            return np.array([0, 0, -1])
        offset = np.array(self.shun.position) - np.array(self.guess.position)
        return np.round(np.array([*offset, self.shun_m]) / cell_m).astype(np.int64)

    def pose(self, turn: float, x: float, y: float, cell_m: float) -> Pose2:
        """The pose so many steps and cells from the guess."""
        guess = self.guess
        return Pose2(
            guess.x_m + x * cell_m, guess.y_m + y * cell_m, guess.yaw_rad + turn * self.turn_step_rad
        )
