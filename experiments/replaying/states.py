"""What one replay leaves for another: the state that slam was in, to go on from or to localise in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.replaying.localizers import ReplayLocalizer
from occmap.geometry import Pose2
from occmap.grid import GridConfig

if TYPE_CHECKING:
    from occmap.localization.slam import SlamLocalizer
    from occmap.scan import Observation

GOES_ON_M = 1.0
"""Odometry whose next pose is this near to its last one goes on,"""
GOES_ON_RAD = 0.5
"""if it is turned by no more than this; else the robot was switched off."""


@dataclass(frozen=True)
class StateOptions:
    """Maps that outlive a run."""

    save_state: Path | None = None
    """Write all that slam knows at the last scan to this file, for the two options below."""
    continue_from: Path | None = None
    """Go on mapping from a saved state. The robot must stand where it stood."""
    localize_in: Path | None = None
    """Map nothing: follow the robot in the map of a saved state."""
    start: tuple[float, float, float] | None = None
    """With --localize-in: X Y YAW of the first scan in that map. By default it is searched for everywhere."""

    def __post_init__(self) -> None:
        if self.continue_from is not None and self.localize_in is not None:
            raise ValueError("--continue-from maps and --localize-in does not: choose one")
        if self.start is not None and self.localize_in is None:
            raise ValueError("--start is a place in the map of --localize-in FILE: give that, too")
        if self.save_state is not None and self.localize_in is not None:
            raise ValueError("--localize-in learns nothing that --save-state could save")
        if self.save_state is not None and not self.save_state.absolute().parent.is_dir():
            raise ValueError(f"there is no folder for --save-state {self.save_state}")

    @property
    def reads_a_state(self) -> bool:
        return self.continue_from is not None or self.localize_in is not None


def make_from_state(options: StateOptions, first: Observation, grid: GridConfig) -> ReplayLocalizer:
    """The localizer that goes on, or the one that follows; ValueError if the file holds no state."""
    from occmap.localization.map_localizer import MapLocalizer

    if options.continue_from is not None:
        slam = _loaded(options.continue_from, grid)
        if slam.odometry_goes_on(first, GOES_ON_M, GOES_ON_RAD):
            slam.rest_until(first.time_s)
        else:
            slam.restart_odometry()
        return slam
    assert options.localize_in is not None, "no state is asked for"
    slam = _loaded(options.localize_in, grid)
    slam.finish()
    return MapLocalizer(slam, None if options.start is None else Pose2(*options.start))


def _loaded(path: Path, grid: GridConfig) -> SlamLocalizer:
    from occmap.localization.state_file import load

    if not path.is_file():
        raise ValueError(f"there is no saved state {path}")
    slam = load(path)
    if slam.told.grid_config != grid:
        raise ValueError(f"{path} holds a map of {slam.told.grid_config}, not of {grid}")
    return slam
