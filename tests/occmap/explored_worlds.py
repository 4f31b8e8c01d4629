"""Whole worlds drawn as text, and an explorer let loose in them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from occmap.decision import Decision, Status
from occmap.explorer import Explorer
from occmap.geometry import Pose2, Twist2
from occmap.grid import Belief
from occmap.localization.localizer import OdometryLocalizer
from occmap.scan import Observation
from tests.ascii_maps import ascii_map
from tests.occmap.kinematic_world import KinematicWorld

YAW_RAD = 0.3
"""Walls askew to the grid, as a random start makes them."""

FLAT = """#########################
          #..........#............#
          #..........#............#
          #..........#............#
          #.......................#
          #...........@...........#
          #.......................#
          #..........#............#
          #..........#............#
          ######...########...#####
          #..........#............#
          #..........#............#
          #..........#............#
          #..........#............#
          #..........#............#
          #..........#............#
          #########################"""

CELL = """############
          #..........#
          #..........#
          #....@.....#
          #..........#
          #..........#
          ############"""

TWO_ROOMS = """######################
               #.........#..........#
               #.........#..........#
               #.........#..........#
               #.........D..........#
               #....@....D.....######
               #.........D..........#
               #.........#..........#
               #.........#..........#
               #.........#..........#
               ######################"""


def boxes_of(drawn, solid, cell_m):
    """(n, 4) one box for every run of solid cells in a row."""
    boxes = []
    for iy, row in enumerate(drawn):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isin(row, list(solid)).astype(int), [0]))))
        boxes += [(x0, iy, x1, iy + 1) for x0, x1 in edges.reshape(-1, 2)]
    return np.array(boxes, float).reshape(-1, 4) * cell_m


@dataclass
class Exploration:
    """A robot (@) among walls (#) and doors (D, open at first), its mind, and all it said."""

    picture: str
    explorer: Explorer
    cell_m: float = 0.3
    noise_scale: float = 1.0
    seed: int = 0
    is_held: bool = False
    """Nothing moves, whatever is commanded."""
    decisions: list[Decision] = field(default_factory=list)

    def __post_init__(self):
        self.drawn = ascii_map(self.picture)
        ((iy, ix),) = np.argwhere(self.drawn == "@")
        start = Pose2((ix + 0.5) * self.cell_m, (iy + 0.5) * self.cell_m, YAW_RAD)
        boxes = boxes_of(self.drawn, "#", self.cell_m)
        self.world = KinematicWorld(boxes, start, np.random.default_rng(self.seed), self.noise_scale)
        self.map_from_world = start.inverse()

    def close_doors(self):
        self.world.boxes = np.vstack((self.world.boxes, boxes_of(self.drawn, "D", self.cell_m)))

    def observe(self):
        return Observation(self.world.time_s, self.world.pose, self.world.scan(), Pose2.identity())

    def run(self, seconds, until=lambda decision: False):
        """See, think, act, until the explorer ends, the time is over, or something is the case."""
        end_s = self.world.time_s + seconds
        while self.world.time_s < end_s:
            decision = self.explorer.decide(self.observe())
            self.decisions.append(decision)
            if decision.status is not Status.EXPLORING or until(decision):
                break
            self.world.step(Twist2.zero() if self.is_held else decision.twist)
        return self.decisions[-1]

    @property
    def events(self):
        return [event for decision in self.decisions for event in decision.events]

    def reasons(self):
        return {left.reason for left in self.explorer.certificate()}

    def explored(self, floor=".@D"):
        """Share of the floor that the map calls free, a cell off the walls."""
        iy, ix = np.nonzero(np.isin(self.drawn, list(floor)))
        offsets = np.linspace(0.2, 0.8, 4)
        dx, dy = (offset.ravel() for offset in np.meshgrid(offsets, offsets))
        x = (ix[:, None] + dx).ravel() * self.cell_m
        y = (iy[:, None] + dy).ravel() * self.cell_m
        grid = self.explorer.grid
        cells = grid.frame.cell_from_map(self.map_from_world.apply(np.column_stack((x, y))))
        inside = (cells >= 0).all(axis=1) & (cells < grid.shape[::-1]).all(axis=1)
        return float((grid.state[cells[inside, 1], cells[inside, 0]] == Belief.FREE).sum() / len(cells))


def exploring(picture, config=None, localizer=None, **options):
    return Exploration(picture, Explorer(config, localizer), **options)


class Sleepy(OdometryLocalizer):
    """A motion filter that finds no scan worth the grid from some moment on."""

    def __init__(self, from_s):
        super().__init__()
        self.from_s = from_s

    def update(self, seen):
        return replace(super().update(seen), insert=seen.time_s < self.from_s)
