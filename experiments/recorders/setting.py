"""What stays the same while a run is watched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from occmap.geometry import Pose2
from sim.building import Box, Building, Door


@dataclass(frozen=True)
class Setting:
    """The building, where the map lies in it, and which of its doors will close."""

    building: Building
    world_from_map: Pose2
    closing: Sequence[Door] = ()
    """In the order of a truth's `door_heights_m`."""

    def standing(self, door_heights_m: Sequence[float]) -> list[tuple[Box, float]]:
        """The panels that stand out of the floor, each with how far it does."""
        doors = zip(self.closing, door_heights_m, strict=True)
        return [(door.panel, height_m) for door, height_m in doors if height_m > 0.0]
