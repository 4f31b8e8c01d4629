"""Where the robot was at every observation."""

from __future__ import annotations

from collections.abc import Sequence

from occmap.geometry import Pose2
from occmap.growing import GrowingArray
from occmap.localization.tracked import Tracked


class Track:
    """Times and poses in the submaps, packed: hours of them must fit into memory."""

    def __init__(self) -> None:
        self._rows = GrowingArray((1 + Tracked.NUMBERS,))  # time (s), and Tracked.numbers

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, time_s: float, tracked: Tracked) -> None:
        """Keep the time and the pose of the next observation."""
        self._rows.append((time_s, *tracked.numbers()))

    def in_map(self, map_from_submap: Sequence[Pose2]) -> list[tuple[float, Pose2]]:
        """(time, map_from_robot) of every observation in turn, given where the submaps lie."""
        rows = self._rows.rows.tolist()
        return [(time_s, Tracked.of_numbers(numbers).in_map(map_from_submap)) for time_s, *numbers in rows]
