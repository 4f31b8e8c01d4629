"""Moments of a run, kept evenly although nobody knows beforehand how long it will be."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from experiments.recorders.frontiers import cells_in_map, chosen_frontier
from occmap.geometry import Points, Pose2
from occmap.grid import Belief, OccupancyGrid

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.episode import Step


@dataclass(frozen=True)
class PackedBelief:
    """The known part of a belief, compressed: some 10 kB for an office."""

    offset: tuple[int, int]  # lattice index (ix, iy) of the first cell kept
    shape: tuple[int, int]  # (ny, nx)
    packed: bytes
    resolution_m: float

    @staticmethod
    def of(grid: OccupancyGrid) -> PackedBelief:
        """What a grid holds now; it may go on changing."""
        known = grid.state != Belief.UNKNOWN
        rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        if not len(rows):
            return PackedBelief(grid.offset, (0, 0), zlib.compress(b""), grid.frame.resolution_m)
        y0, y1, x0, x1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
        packed = zlib.compress(np.ascontiguousarray(grid.state[y0:y1, x0:x1]).data, 1)
        offset = (grid.offset[0] + int(x0), grid.offset[1] + int(y0))
        return PackedBelief(offset, (int(y1 - y0), int(x1 - x0)), packed, grid.frame.resolution_m)

    def state(self) -> NDArray[np.uint8]:
        """(ny, nx) values of Belief, row 0 at the lowest y."""
        return np.frombuffer(zlib.decompress(self.packed), np.uint8).reshape(self.shape)

    @property
    def known_cells(self) -> int:
        """Free and occupied ones."""
        return int(np.count_nonzero(self.state()))


@dataclass(frozen=True)
class Snapshot:
    """What a picture of one instant needs. Positions are in `world`; the belief stays in the map frame."""

    time_s: float
    activity: str
    explored: float | None  # None before the first score
    path_length_m: float
    belief: PackedBelief
    world_from_robot: Pose2  # true
    world_from_estimate: Pose2
    door_heights_m: tuple[float, ...]  # how far each closing door stands out of the floor
    trail_length: int  # how many points of the log's trail lie behind the robot
    frontiers: Points  # (n, 2) cells of all frontiers but the chosen one
    chosen: Points  # (n, 2) cells of the one the robot drives to
    goal: Points  # (0 or 1, 2)
    path: Points  # (n, 2) waypoints


class SnapshotLog:
    """Keeps at most `capacity` snapshots, evenly spaced in time, of an episode of any length.

    Starts with one every `stride` steps; whenever the log is full it forgets every second one and
    doubles the stride. Between capacity / 2 and capacity remain, and the end; memory stays bounded.
    """

    def __init__(
        self, world_from_map: Pose2, curve: ScoreCurve, capacity: int = 300, stride: int = 5
    ) -> None:
        if capacity < 2 or stride < 1:
            raise ValueError(f"need capacity >= 2 and stride >= 1, got {capacity} and {stride}")
        self.snapshots: list[Snapshot] = []
        self._world_from_map = world_from_map
        self._curve = curve
        self._capacity = capacity
        self._stride = stride
        self._steps = 0
        self._trail: list[tuple[float, float]] = []
        self._last: Step | None = None

    def record(self, step: Step) -> None:
        """Keep this step if it is its turn."""
        estimate = self._world_from_map @ step.decision.map_from_robot
        self._trail.append(estimate.position)
        if self._steps % self._stride == 0:
            self._keep(step)
        self._steps += 1
        self._last = step

    def finish(self) -> None:
        """Make sure that the log ends where the run ended."""
        if self._last is not None and self.snapshots[-1].trail_length != len(self._trail):
            self.snapshots.append(self._snapshot(self._last))

    def trail(self, snapshot: Snapshot) -> Points:
        """(n, 2) where the robot believed to have been up to a snapshot, in world."""
        return np.array(self._trail[: snapshot.trail_length])

    def _keep(self, step: Step) -> None:
        if len(self.snapshots) == self._capacity:
            self.snapshots = self.snapshots[::2]
            self._stride *= 2
            if self._steps % self._stride:
                return  # this one's turn went with the finer stride
        self.snapshots.append(self._snapshot(step))

    def _snapshot(self, step: Step) -> Snapshot:
        decision, to_world = step.decision, self._world_from_map.apply
        resolution_m = step.grid.frame.resolution_m
        chosen = chosen_frontier(decision)
        nothing = np.empty((0, 2))
        others = [cells_in_map(f, resolution_m) for f in decision.frontiers if f is not chosen]
        return Snapshot(
            time_s=step.observation.time_s,
            activity=decision.activity,
            explored=self._curve.latest.score.explored if self._curve.samples else None,
            path_length_m=step.truth.path_length_m,
            belief=PackedBelief.of(step.grid),
            world_from_robot=step.truth.world_from_robot,
            world_from_estimate=self._world_from_map @ decision.map_from_robot,
            door_heights_m=step.truth.door_heights_m,
            trail_length=len(self._trail),
            frontiers=to_world(np.concatenate([nothing, *others])),
            chosen=nothing if chosen is None else to_world(cells_in_map(chosen, resolution_m)),
            goal=nothing if decision.goal is None else to_world(np.array([decision.goal.viewpoint_in_map])),
            path=nothing if decision.path is None else to_world(decision.path.waypoints_in_map),
        )
