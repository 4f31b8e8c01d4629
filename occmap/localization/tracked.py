"""Where the tracker has the robot: a pose among submaps, whatever becomes of where these lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from occmap.geometry import Pose2, wrap_angle


@dataclass(frozen=True)
class Tracked:
    """A pose in the submaps: in `submap`, on its way over to `submap + 1` by `blend` (0 to 1)."""

    submap: int
    submap_from_robot: Pose2
    next_from_robot: Pose2
    blend: float

    NUMBERS: ClassVar[int] = 8

    def in_map(self, map_from_submap: Sequence[Pose2]) -> Pose2:
        """map_from_robot, given where the submaps lie; without a seam from one submap to the next."""
        older = map_from_submap[self.submap] @ self.submap_from_robot
        if self.blend == 0.0:
            return older
        younger = map_from_submap[self.submap + 1] @ self.next_from_robot
        return Pose2(
            older.x_m + self.blend * (younger.x_m - older.x_m),
            older.y_m + self.blend * (younger.y_m - older.y_m),
            older.yaw_rad + self.blend * wrap_angle(younger.yaw_rad - older.yaw_rad),
        )

    def numbers(self) -> tuple[float, ...]:
        """(NUMBERS,) the same in numbers, to be kept in an array."""
        a, b = self.submap_from_robot, self.next_from_robot
        return self.submap, a.x_m, a.y_m, a.yaw_rad, b.x_m, b.y_m, b.yaw_rad, self.blend

    @staticmethod
    def of_numbers(numbers: Sequence[float]) -> Tracked:
        """The pose that `numbers` came from."""
        return Tracked(int(numbers[0]), Pose2(*numbers[1:4]), Pose2(*numbers[4:7]), numbers[7])
