"""A small episode without a simulator or a mind: a ghost drives a circle, a hand-made lidar fills the map.

Enough for recorders, which consume Steps and ask nothing back. The map frame is turned against the
world, one wall is longer than the others, and the estimate drifts: what is mirrored, turned or swapped shows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from experiments.curves import Sample
from experiments.episode import Step
from experiments.recorders.setting import Setting
from experiments.scoring import MapScore
from occmap.decision import Decision, Status
from occmap.frontiers import Frontier
from occmap.geometry import Pose2, Twist2
from occmap.goals import Goal
from occmap.grid import Belief, OccupancyGrid
from occmap.path import Path
from occmap.scan import Observation, Scan
from sim.building import Box, Building, Cylinder, Door
from sim.robot import Truth

START = Pose2(3.0, 2.0, 0.7)
SCAN_PERIOD_S = 0.1


def building() -> Building:
    """A hall of 12 m x 8 m with a stub wall, a column and a table."""
    outer = ((6.0, 0.05, 6.0, 0.05), (6.0, 7.95, 6.0, 0.05), (0.05, 4.0, 0.05, 4.0), (11.95, 4.0, 0.05, 4.0))
    walls = tuple(Box(*sides) for sides in (*outer, (7.0, 1.6, 0.05, 1.6)))
    table = Box(10.0, 6.5, 0.5, 0.3, yaw_rad=0.4, kind="furniture")
    column = Cylinder(5.0, 6.0, 0.25, kind="column")
    return Building("fake hall", "hall", (0.0, 0.0), (12.0, 8.0), (*walls, table, column), START)


def setting() -> Setting:
    """The hall with a door in its middle that closes; the robot's lidar looks through it all the same."""
    return Setting(building(), START, (Door(Box(7.0, 4.0, 0.05, 0.45)),))


def door_height_m(time_s: float) -> float:
    """How far the door stands out of the floor: it rises from 2 s to 3 s."""
    return min(max(time_s - 2.0, 0.0), 1.0)


def ranges_to(
    solids: tuple, origin: tuple[float, float], bearings_rad: np.ndarray, max_m: float
) -> np.ndarray:
    """(n,) distance along each bearing to the nearest solid, inf beyond max_m (slabs and circles)."""
    nearest = np.full(bearings_rad.shape, np.inf)
    for solid in solids:
        yaw = getattr(solid, "yaw_rad", 0.0)
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = origin[0] - solid.x_m, origin[1] - solid.y_m
        p = (c * dx + s * dy, c * dy - s * dx)
        u = (np.cos(bearings_rad - yaw), np.sin(bearings_rad - yaw))
        if isinstance(solid, Cylinder):
            b = p[0] * u[0] + p[1] * u[1]
            root = b**2 - (p[0] ** 2 + p[1] ** 2 - solid.radius_m**2)
            enter = np.where(root > 0.0, -b - np.sqrt(np.maximum(root, 0.0)), np.inf)
        else:
            with np.errstate(divide="ignore"):
                slabs = [
                    np.sort((np.array([[-h], [h]]) - p[k]) / u[k], axis=0)
                    for k, h in enumerate(halves(solid))
                ]
            enter = np.maximum(slabs[0][0], slabs[1][0])
            enter = np.where(enter <= np.minimum(slabs[0][1], slabs[1][1]), enter, np.inf)
        nearest = np.where((enter > 0.0) & (enter < nearest), enter, nearest)
    return np.where(nearest < max_m, nearest, np.inf)


def halves(box: Box) -> tuple[float, float]:
    return box.half_x_m, box.half_y_m


def insert(grid: OccupancyGrid, scan: Scan, map_from_lidar: Pose2) -> None:
    """Free along each beam, occupied at its end; sampled, not ray-cast: good enough to look at."""
    reach = np.where(np.isposinf(scan.ranges_m), scan.max_range_m, np.nan_to_num(scan.ranges_m))
    fractions = np.linspace(0.0, 1.0, 150)[:, None] * np.maximum(reach - 0.06, 0.0)
    along = np.stack((fractions * np.cos(scan.bearings_rad), fractions * np.sin(scan.bearings_rad)), axis=-1)
    free = map_from_lidar.apply(along.reshape(-1, 2))
    hits = map_from_lidar.apply(scan.hits_in_lidar())
    everything = np.concatenate((free, hits))
    grid.grow_to_contain(tuple(everything.min(axis=0)), tuple(everything.max(axis=0)))
    for points, belief in ((free, Belief.FREE), (hits, Belief.OCCUPIED)):
        ix, iy = grid.frame.cell_from_map(points).T
        grid.state[iy, ix] = np.maximum(grid.state[iy, ix], belief)


def frontiers_of(grid: OccupancyGrid) -> tuple[Frontier, ...]:
    edge = (grid.state == Belief.FREE) & ndimage.binary_dilation(grid.state == Belief.UNKNOWN)
    labels = np.empty(edge.shape, np.int32)
    ndimage.label(edge, np.ones((3, 3)), output=labels)
    found = []
    for label in range(1, labels.max() + 1):
        iy, ix = np.nonzero(labels == label)
        if len(ix) >= 4:
            cells = np.column_stack((ix, iy))
            centroid = tuple(grid.frame.map_from_cell(cells).mean(axis=0))
            found.append(Frontier(cells, centroid, len(ix)))
    return tuple(found)


@dataclass
class FakeCurve:
    """Stands in for ScoreCurve, scores made up."""

    samples: list[Sample]

    @property
    def latest(self) -> Sample:
        return self.samples[-1]


def fake_episode(steps: int = 60, curve: FakeCurve | None = None, beams: int = 180) -> Iterator[Step]:
    """Steps of a ghost that circles through the hall once in `steps` scans."""
    solids, grid, bearings = building().solids, OccupancyGrid(), np.linspace(-math.pi, math.pi, beams, False)
    length_m, before = 0.0, START
    goal, path, frontiers = None, None, ()
    for k in range(steps):
        time_s, truth = k * SCAN_PERIOD_S, ghost(k / steps)
        length_m += truth.distance_to(before)
        before = truth
        map_from_robot = START.inverse() @ truth @ Pose2(0.0005 * k, 0.0, 0.0002 * k)
        ranges_m = ranges_to(solids, truth.position, truth.yaw_rad + bearings, 6.0)
        ranges_m[7] = np.nan
        scan = Scan(bearings, ranges_m, 6.0)
        insert(grid, scan, map_from_robot)
        if k % 10 == 0:
            frontiers = frontiers_of(grid)
            goal, path = goal_of(frontiers[0], map_from_robot) if frontiers else (None, None)
        if curve is not None and k % 5 == 0:
            curve.samples.append(sample(time_s, length_m, (k + 1) / steps))
        activity = "recovering" if 20 <= k < 26 else "complete" if k == steps - 1 else "exploring"
        yield Step(
            Truth(time_s, truth, Twist2.zero(), 0, 0.0, 1.0, length_m, (door_height_m(time_s),)),
            Observation(time_s, map_from_robot, scan, Pose2.identity()),
            Decision(
                status=Status.COMPLETE if activity == "complete" else Status.EXPLORING,
                twist=Twist2.zero(),
                map_from_robot=map_from_robot,
                activity=activity,
                goal=goal,
                path=path,
                frontiers=frontiers,
                unknown_left=(),
                events=(str(goal),) if k % 10 == 0 else (),
                replans=0,
                goal_switches=0,
                stage_s={},
            ),
            grid,
        )


def ghost(turn: float) -> Pose2:
    """Where the robot truly is after this share of its circle; it starts at START."""
    angle = 2.0 * math.pi * turn
    return Pose2(3.0 + 1.6 * math.sin(angle), 3.6 - 1.6 * math.cos(angle), START.yaw_rad + angle)


def goal_of(frontier: Frontier, map_from_robot: Pose2) -> tuple[Goal, Path]:
    """The middle of a frontier, and the beeline to it."""
    viewpoint = frontier.centroid_in_map
    path = Path.through(np.array([map_from_robot.position, viewpoint]))
    return Goal(frontier, viewpoint, path.length_m, 1.03, 1.03 - path.length_m, np.empty((0, 2))), path


def sample(time_s: float, length_m: float, done: float) -> Sample:
    """Made-up scores that rise with what was done."""
    score = MapScore(done, done, 0.001 * done, done, 0.01, 0.03, round(20 * done))
    return Sample(time_s, length_m, 0.005 * time_s, 3, score)
