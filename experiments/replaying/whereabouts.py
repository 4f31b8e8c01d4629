"""Whether a robot that is followed in a finished map was ever found there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from experiments.replaying.runner import ReplayStep
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid

if TYPE_CHECKING:
    from occmap.localization.map_localizer import MapLocalizer


@dataclass
class Whereabouts:
    """A recorder that counts the scans after which it was known where in the map the robot is."""

    localizer: MapLocalizer
    scans: int = 0
    known: int = 0

    def record(self, step: ReplayStep) -> None:
        """Ask the localizer, which has just seen this scan."""
        self.scans += 1
        self.known += not self.localizer.is_lost

    def finish(self, poses: Sequence[Pose2], grid: OccupancyGrid) -> None:
        """What is put right in hindsight was lost all the same."""

    def close(self) -> None:
        """Nothing is open."""

    @property
    def is_lost(self) -> bool:
        """At the end, or all along."""
        return self.localizer.is_lost

    def facts(self) -> dict[str, Any]:
        """As the summary holds them."""
        return {"known_share": self.known / self.scans, "is_lost": self.is_lost}

    def text(self) -> str:
        """A line for people."""
        if not self.known:
            return "lost: the robot was not found in the map, the trajectory is odometry's alone"
        share = f"it was known where the robot is after {self.known / self.scans:.1%} of the scans"
        return (
            f"lost: {share}, but not at the end, which is odometry's alone"
            if self.is_lost
            else f"found: {share}"
        )
