"""A compass made of walls: buildings run along two directions, a quarter turn apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.geometry import Pose2
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.localization.submap import Submap

QUARTER = 0.5 * math.pi
SEARCHES = ((0.5 * QUARTER, 0.0044, 2.0), (0.018, 0.0009, 1.0))
"""How far to seek the sharpest lines, in what steps, and in cells how wide. A quarter of a degree turns the
end of a wall of 10 m by two cells; where lines lie close together, it finds them up to a degree off."""
ITERATIONS = 4
"""Of the straightening: walls join in as it turns."""


@dataclass(frozen=True)
class CompassConfig(Positive):
    """What counts as a wall, and how far its direction is believed."""

    facing_rad: float = 0.26
    """A surfel that faces up to so far off one of the four directions may be of a wall along it."""
    least_count: float = 2.0
    """Surfels seen less often do not count."""
    cell_m: float = 0.02
    """Lines are told apart by this: somewhat more than a surfel is off its wall."""
    still_cell_m: float = 0.015
    """The same for what was seen standing, which is sharper: a wall and the front of a cupboard let into it,
    4 cm deeper, would be one line askew by half a degree."""
    reach_m: float = 40.0
    """Walls farther than this from a submap's origin do not count."""
    least_wall: float = 30.0
    """A line of less weight than this, in points, is no wall."""
    least_share: float = 0.5
    """Of all that looks like wall, that must lie in straight lines along the two directions."""
    off_m: float = 0.07
    """How far a point in a line is off it, as if neighbours did not err together (standard deviation)."""
    floor_rad: float = 0.002
    """Standard deviation of a direction, however long the walls: masons err too."""
    dcs_chi2: float = 1.0
    """A wall that is more askew is not believed to run along the building (dynamic covariance scaling)."""
    askew_chi2: float = 4.0
    """One that is more askew than this says that it, or north, is not how the building runs."""


@dataclass(frozen=True)
class Direction:
    """Direction along which the walls of a submap run."""

    yaw_rad: float
    """In the submap's frame; a quarter turn more or less is the same."""
    sigma_rad: float


class Compass:
    """Adds to a pose graph what the walls of submaps say about their headings.

    Headings otherwise do a random walk from submap to submap, which only loops bound. Walls that are
    parallel to north's by less than the walk could have turned them are taken to be exactly so (the
    Manhattan world of Coughlan and Yuille 1999; in SLAM, Nguyen et al. 2007, "Orthogonal SLAM"); others
    weigh nothing. North is what most walls agree with: of the rooms of a real house any may stand askew, and
    the first, taken for north, would bend all of the others.
    """

    def __init__(self, config: CompassConfig, graph: PoseGraph, submaps: Sequence[Submap]) -> None:
        self.config = config
        self._graph, self._submaps = graph, submaps
        self._walls: dict[int, Direction] = {}  # by submap
        self._edges: dict[int, int] = {}  # by submap: from north's
        self._north: int | None = None  # the submap whose walls the others are held against
        self._still: int | None = None  # the submap that was seen from one place: as sharply as can be

    def look(self, submap: int, *, is_still: bool = False) -> None:
        """Measure a submap's wall direction, again if it has grown, and tie it to north in the graph.

        is_still: whether all of them were seen from one place.
        """
        if submap in (self._north, self._still):
            return
        cell_m = self.config.still_cell_m if is_still else self.config.cell_m
        expected_rad = None if self._north is None else self._north_rad(self._north, submap)
        direction = self.direction(self._submaps[submap].rows, cell_m, expected_rad)
        self._untie(submap)
        if direction is None:
            self._walls.pop(submap, None)
            return
        self._walls[submap] = direction
        self._still = submap if is_still else self._still
        if self._north is None:
            self._north = submap
        elif self._is_better_north(submap, self._north):
            self._turn_north_to(submap)
        else:
            self._tie(submap, self._north)

    def _north_rad(self, north: int, submap: int) -> float:
        """Yaw of north's walls in the frame of a submap, as far as the graph knows."""
        return self._walls[north].yaw_rad - self._turn_rad(north, submap)

    def _turn_rad(self, a: int, b: int) -> float:
        return self._graph.pose(b).yaw_rad - self._graph.pose(a).yaw_rad

    def _is_better_north(self, submap: int, north: int) -> bool:
        """Whether most walls are askew to north's, and fewer to those of this submap."""
        askew = self._askew(north)
        return 2 * askew > len(self._walls) and self._askew(submap) < askew

    def _askew(self, submap: int) -> int:
        """How many submaps' walls are askew to those of one."""
        askew = 0
        for k, walls in self._walls.items():
            off_rad = _within_quarter(walls.yaw_rad - self._north_rad(submap, k))
            askew += (off_rad / walls.sigma_rad) ** 2 > self.config.askew_chi2
        return askew

    def _turn_north_to(self, submap: int) -> None:
        """Hold all walls against another submap's from now on."""
        for other in tuple(self._edges):
            self._untie(other)
        self._north = submap
        for other in self._walls:
            if other != submap:
                self._tie(other, submap)

    def _tie(self, submap: int, north: int) -> None:
        """Say in the graph how a submap is turned against north."""
        walls = self._walls[submap]
        turn_rad = self._turn_rad(north, submap)
        turn_rad += _within_quarter(self._north_rad(north, submap) - walls.yaw_rad)
        information = np.diag([0.0, 0.0, walls.sigma_rad**-2])
        self._edges[submap] = self._graph.add_edge(
            north, submap, Pose2(0.0, 0.0, turn_rad), information, Loss.DCS, self.config.dcs_chi2
        )

    def _untie(self, submap: int) -> None:
        """Take back what was said of a submap, if anything was."""
        edge = self._edges.pop(submap, None)
        if edge is not None:
            self._graph.remove_edge(edge)

    def direction(
        self, surfels: NDArray[np.float64], cell_m: float, expected_rad: float | None = None
    ) -> Direction | None:
        """Direction of the walls among surfels (n, COLUMNS), sought near expected_rad; None if too few."""
        from occmap.localization import compass_kernels as kernels

        c, cosine, yaw = self.config, math.cos(self.config.facing_rad), expected_rad
        if yaw is None:
            yaw = 0.0
            for within_rad, step_rad, cells in SEARCHES:
                yaw = kernels.sharpest(
                    surfels, yaw, math.ceil(within_rad / step_rad), step_rad,
                    cosine, c.least_count, cells * cell_m, c.reach_m,
                )  # fmt: skip
        yaw, inertia, share = kernels.straighten(
            surfels, yaw, ITERATIONS, cosine, c.least_count, cell_m, c.reach_m, c.least_wall
        )
        if share < c.least_share:
            return None
        return Direction(yaw, math.hypot(c.off_m / math.sqrt(inertia), c.floor_rad))


def _within_quarter(turn_rad: float) -> float:
    """A turn but for its quarters: from an eighth of a turn to the right to one to the left."""
    return (turn_rad + 0.5 * QUARTER) % QUARTER - 0.5 * QUARTER
