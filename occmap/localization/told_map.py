"""What the receiver of the estimates knows: poses that stay true to the grid they are used in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from occmap.config_checks import Positive
from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization.box import Box
from occmap.localization.map_rebuild import MapRebuild, displacement_m
from occmap.localization.mapped_scans import MappedScan, MappedScans
from occmap.localization.tracked import Tracked
from occmap.mapper import Mapper
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig

AFFECTED_SHARE = 0.2
"""Of the move that is worth a new grid: what submaps show that move by less need not be built anew."""


@dataclass(frozen=True)
class ToldMapConfig(Positive):
    """Which scans are worth spending on the grid, and when it is built anew."""

    every_m: float = 0.07
    """A scan is mapped once the robot has driven this far since the last one."""
    every_rad: float = 0.08
    """Or has turned this far."""
    every_s: float = 0.5
    """Or this long has passed: what it looks at may have changed."""
    moved_m: float = 0.04
    """A correction is worth a new grid once it moves a place by half a cell."""
    seam_m: float = 0.03
    """One that moves the youngest submap by no more is taken over at its seam."""
    lever_m: float = 5.0
    """A turn counts as the move of a wall this far away."""
    urgent_m: float = 0.25
    """One that moves a place by more is not put off until it is affordable."""
    scans_per_turn: int = 120
    """So many scans are spent on the new grid in one update: about 10 ms, none may hold up the robot."""
    effort_m_per_turn: float = 160_000.0
    """Fewer if the effort comes to more (see MappedScan): outdoors beams reach far."""
    surveyed_per_turn: int = 500
    """Before the first new grid so many scans a turn are looked through, for the room that it needs."""
    scans_on_average: int = 12
    """And so many in an average update: a new grid is affordable once that has been saved up."""
    room_m: float = 10.0
    """The robot may drive so far meanwhile without leaving the part that is built anew."""


class ToldMap:
    """The submaps' poses as last told, and the scans in the grid.

    A correction takes effect when the grid has been built anew with it: pose and grid change together.
    The grid handed over last is read again at the next correction, with all scans inserted since.
    """

    def __init__(
        self,
        config: ToldMapConfig,
        grid: GridConfig | None = None,
        sensor_model: SensorModelConfig | None = None,
    ) -> None:
        self.config = config
        self.grid_config = grid or GridConfig()
        self.mapper = Mapper(sensor_model)
        self.scans = MappedScans()
        self.map_from_submap: list[Pose2] = []
        self._reach_m: list[float] = []  # of each submap, from its origin
        self._corrected: list[Pose2] = []  # what map_from_submap will be once the rebuild is done
        self._rebuild: MapRebuild | None = None
        self._live: OccupancyGrid | None = None  # the one handed over last
        self._owed: OccupancyGrid | None = None  # to be handed over, to a receiver that has none
        self._updates = 0  # since a rebuilding began
        self._last = (-math.inf, Pose2.identity())

    def add_submap(self, previous_from_submap: Pose2, map_from_submap: Pose2) -> None:
        """Take in a submap begun by the tracker.

        It lies where all that was seen has it, if that is near enough to where the last one says for no seam
        to show.
        """
        for poses in (self.map_from_submap, self._corrected if self._rebuild else []):
            pose = poses[-1] @ previous_from_submap if poses else previous_from_submap
            near = displacement_m(pose, map_from_submap, self.config.lever_m) <= self.config.seam_m
            poses.append(map_from_submap if near else pose)
        self._reach_m.append(0.0)

    def pose_of(self, tracked: Tracked) -> Pose2:
        """The pose map_from_robot as told."""
        return tracked.in_map(self.map_from_submap)

    def wants(self, time_s: float, tracked: Tracked) -> bool:
        """Whether a scan is worth mapping. The answer is remembered as done."""
        c, (last_s, last) = self.config, self._last
        pose = self.pose_of(tracked)
        moved = last.inverse() @ pose
        still = math.hypot(moved.x_m, moved.y_m) < c.every_m and abs(moved.yaw_rad) < c.every_rad
        if still and 0.0 <= time_s - last_s < c.every_s:
            return False
        self._last = (time_s, pose)
        return True

    def add_scan(self, scan: Scan, robot_from_lidar: Pose2, tracked: Tracked) -> Scan:
        """Remember a scan that the receiver is to insert; returns it as it is kept."""
        self.scans.append(MappedScan.of(scan, robot_from_lidar, tracked))
        mapped = self.scans[-1]
        for k, pose in (
            (tracked.submap, tracked.submap_from_robot),
            (tracked.submap + 1, tracked.next_from_robot),
        ):
            if k < len(self._reach_m):
                distance = math.hypot(*(pose @ robot_from_lidar).position)
                self._reach_m[k] = max(self._reach_m[k], distance + mapped.reach_m)
        return mapped.scan

    def hand_over(self) -> None:
        """Hand the grid over with the next estimate: the receiver is a new one and has none."""
        self._owed = self.fresh(self.map_from_submap)
        if self._live is not None:  # else the first correction still builds all of the grid anew
            self._live = self._owed

    @property
    def is_rebuilding(self) -> bool:
        """Whether a new grid is being built."""
        return self._rebuild is not None

    @property
    def can_afford_correction(self) -> bool:
        """Whether enough updates have passed since the last new grid to pay for another."""
        return self._updates * self.config.scans_on_average >= len(self.scans)

    def correct(self, map_from_submap: list[Pose2]) -> bool:
        """Begin to take over corrected poses, if they differ enough; False if that has to wait."""
        if not any(self._moved(map_from_submap, self.config.moved_m)):
            return True
        urgent = any(self._moved(map_from_submap, self.config.urgent_m))
        if self.is_rebuilding or not (urgent or self.can_afford_correction):
            return False
        self._corrected, self._updates = map_from_submap, 0
        self._begin()
        return True

    def step(self) -> OccupancyGrid | None:
        """Do a turn's part of the rebuilding; the new grid, and poses told by it, when it is done.

        A grid that is owed is handed over meanwhile.
        """
        self._updates += 1
        owed, self._owed = self._owed, None
        return self._rebuilt() or owed

    def _rebuilt(self) -> OccupancyGrid | None:
        """The new grid, if this turn's part of it was the last."""
        if self._rebuild is None or not self._is_built(self._rebuild):
            return None
        if not self._rebuild.box.holds(self._affected()):
            self._begin()  # the robot has driven out of it meanwhile
            return None
        self._live = self._rebuild.grid if self._live is None else self._rebuild.joined_with(self._live)
        self.map_from_submap, self._rebuild = self._corrected, None
        self._last = (-math.inf, Pose2.identity())
        return self._live

    def _is_built(self, rebuild: MapRebuild) -> bool:
        """Do a turn's part of a rebuilding; whether that was the last."""
        c = self.config
        if self._live is None and not rebuild.is_surveyed:
            rebuild.survey(c.surveyed_per_turn, c.room_m)
            return False
        return rebuild.step(c.scans_per_turn, c.effort_m_per_turn)

    def fresh(self, map_from_submap: list[Pose2]) -> OccupancyGrid:
        """A grid of all scans at once, at the given poses."""
        rebuild = MapRebuild(self.scans, map_from_submap, Box.everywhere(), self.mapper, self.grid_config)
        rebuild.survey(len(self.scans))
        while not rebuild.step(len(self.scans), math.inf):
            pass
        return rebuild.grid

    def _begin(self) -> None:
        box = Box.everywhere() if self._live is None else Box.over([self._affected()], self.config.room_m)
        self._rebuild = MapRebuild(self.scans, self._corrected, box, self.mapper, self.grid_config)
        if self._live is not None:
            self._rebuild.make_room(self._live)

    def _moved(self, to: list[Pose2], by_m: float) -> list[bool]:
        return [
            displacement_m(a, b, self.config.lever_m) > by_m
            for a, b in zip(self.map_from_submap, to, strict=True)
        ]

    def _affected(self) -> Box:
        """Box of all that scans of moved submaps voted on, where they were and where they are."""
        moved = self._moved(self._corrected, AFFECTED_SHARE * self.config.moved_m)
        return Box.over(
            [
                Box.around(*poses[k].position, self._reach_m[k])
                for k in np.flatnonzero(moved)
                for poses in (self.map_from_submap, self._corrected)
            ]
        )
