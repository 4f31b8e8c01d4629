"""What happens seldom, made to happen once before the clock runs: no kernel is compiled or loaded later."""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from occmap.decision import Reason
from occmap.explorer import Explorer
from occmap.follower import Follower
from occmap.frontiers import Frontier, edge_cells
from occmap.geometry import Pose2, Twist2
from occmap.goals import Goal
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.map_localizer import MapLocalizer
from occmap.localization.pose_graph import PoseGraph
from occmap.looked_at import LookedAt
from occmap.memory import FailedLooks
from occmap.nooks import Nooks
from occmap.planner import Planner
from occmap.scan import Observation, Scan
from occmap.sensor_model import SensorModelConfig

MANY = 8
"""Places that are tried, and cells of each: one of them will do."""
STEPS = 5
"""Of a walk through an empty room: enough to close loops."""


def close_loops(
    seen: Sequence[Observation],
    config: SlamConfig | None = None,
    grid: GridConfig | None = None,
    sensor_model: SensorModelConfig | None = None,
) -> SlamLocalizer:
    """Drive there and back in tiny submaps, sure of nothing: all that slam may ever need is then loaded."""
    c = config or SlamConfig()
    unsure = replace(
        c,
        matcher=replace(c.matcher, sure_fit=2.0),
        tracker=replace(c.tracker, insert_every_m=0.02, insert_every_rad=0.02, scans_per_half=2),
        loops=replace(c.loops, candidates=replace(c.loops.candidates, gap=1)),
    )
    slam = SlamLocalizer(unsure, grid, sensor_model)
    for each in (*seen, *reversed(seen)):
        slam.update(each)
    slam.finish()
    slam.map()
    return slam


def find_oneself(lost: MapLocalizer, seen: Sequence[Observation]) -> None:
    """Stand where one was, lost, until the place is found; then go along a little."""
    for _ in range(MANY * MANY):
        lost.update(seen[0])
        if not lost.is_lost:
            break
    for each in seen[:MANY]:
        lost.update(each)


def compile_aside(pose: str) -> None:
    """The driving first, which the process that explores comes to last; then what slam needs.

    In a process of its own, without the world: garbage goes with it.
    """
    gc.disable()
    drive_a_way()
    if pose == "slam":
        close_loops(walk())


def walk() -> list[Observation]:
    """What a lidar sees on an arc through an empty room of 6 m x 4 m."""
    bearings_rad, seen = np.radians(np.arange(360.0)), []
    start = here = Pose2(-1.5, -0.5, 0.2)
    for step in range(STEPS):
        cos, sin = np.cos(bearings_rad + here.yaw_rad), np.sin(bearings_rad + here.yaw_rad)
        to_x_m, to_y_m = (np.copysign(3.0, cos) - here.x_m) / cos, (np.copysign(2.0, sin) - here.y_m) / sin
        scan = Scan(bearings_rad, np.minimum(to_x_m, to_y_m), max_range_m=12.0)
        seen.append(Observation(float(step), start.inverse() @ here, scan, Pose2.identity()))
        here = here @ Pose2(0.2, 0.0, 0.2)
    return seen


def settle_a_graph() -> None:
    """Optimise two poses that two edges disagree about."""
    graph = PoseGraph()
    nodes = [graph.add_node(Pose2.identity()) for _ in range(2)]
    for forwards_m in (1.0, 1.1):
        graph.add_edge(nodes[0], nodes[1], Pose2(forwards_m, 0.0, 0.0), np.eye(3))
    graph.optimise()
    graph.weights()


def drive_a_way() -> None:
    """Plan a way over an empty floor that nobody has mapped, and follow it for a scan."""
    here, grid = Pose2(0.5, 0.5, 0.0), OccupancyGrid()
    grid.grow_to_contain((0.0, 0.0), (3.0, 3.0))
    grid.state[:] = Belief.FREE
    clearance_m = np.ones(grid.shape, np.float32)
    bearings_rad = np.linspace(-math.pi, math.pi, 60)
    scan = Scan(bearings_rad, np.full(60, 0.8), max_range_m=2.0)
    wave = Planner().flood(grid, clearance_m, grid.frame.cell_at(*here.position))
    path = wave.path_to(grid.frame.cell_at(2.5, 2.0))
    assert path is not None, "nothing is in the way"
    Follower().follow(path, here, Twist2.zero(), scan, Pose2.identity(), grid, clearance_m)


def rare_moments(explorer: Explorer, here: Pose2) -> None:
    """Ask what an exploring mind asks now and then only: of leftovers, slits, corrections, ways to evade."""
    grid, chooser = explorer.grid, explorer.search.chooser
    cell = grid.frame.cell_at(*here.position)
    wave = explorer.planner.flood(grid, explorer.map.clearance_m, cell)
    for edge in edges_of(explorer)[:MANY]:
        chooser.goal_for(edge, grid, wave, 2.5, 1.0)
    mouth = Frontier(np.array([cell] * MANY), here.position, MANY)
    watched = np.array([here.position])
    goal = Goal(replace(mouth, size=1), here.position, math.inf, math.nan, 0.0, watched)
    chooser.in_sight_m2(grid, *cell)
    chooser.is_gone(replace(goal, is_nook=True), grid, explorer.map.frontier_mask)
    looks = FailedLooks()
    Nooks(chooser, looks, LookedAt(), None).goal_into(mouth, grid, wave, 1.0)
    looks.note(goal, Reason.TOO_NARROW, "", grid)
    looks.at(mouth, grid)
    explorer.ending.carry_over(Pose2.identity(), grid)
    around = explorer.follower.surroundings
    around.free_bearing(0.0, 1.0, 0.1)
    around.is_free(Twist2.zero(), Twist2(-0.1, 0.0), 0.1)


def edges_of(explorer: Explorer) -> list[Frontier]:
    """Whatever borders on the unknown, frontier or not, some cells at a time."""
    grid = explorer.grid
    iy, ix = np.divmod(edge_cells(grid.state, slice(0, grid.shape[0])).astype(np.int64), grid.shape[1])
    cells = np.column_stack((ix, iy))
    parts = [cells[k : k + MANY].copy() for k in range(0, len(cells), MANY)]
    return [Frontier(part, grid.frame.centre_of(*part[0].tolist()), len(part)) for part in parts]


@contextmanager
def garbage_left_alone() -> Iterator[None]:
    """Look for garbage less often while kernels are compiled and loaded; what then exists, stays.

    A compiler makes millions of objects, few of them garbage in cycles. To look through them all takes a
    tenth of a second each time: in the middle of a drive, the robot would have to wait for that.
    """
    usual = gc.get_threshold()
    gc.set_threshold(200_000, *usual[1:])
    try:
        yield
    finally:
        gc.freeze()
        gc.set_threshold(*usual)
