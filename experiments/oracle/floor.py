"""A known floor: where a body can be, what there is to see, and what is seen from where."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from experiments.oracle.samples import samples_of
from occmap.geometry import Points, Pose2
from sim.truth import PLACE_SPACING_M, TOUCH, Mask, TruthGrid, reachable

Ints = NDArray[np.int32]

MOST_NODES, MOST_PLACES = 40_000, 4_000
"""The lattices below are no finer than these allow, however large the building."""
LEAST_SEEN = 0.998
"""Share of the samples that must be in sight of the places: otherwise the lattices were too coarse."""


@dataclass(frozen=True)
class Rows:
    """A sparse matrix of ones: what belongs to each row."""

    starts: NDArray[np.int64]  # (n + 1,)
    columns: Ints

    def __getitem__(self, row: int) -> Ints:
        return self.columns[self.starts[row] : self.starts[row + 1]]


@dataclass(frozen=True)
class Lattices:
    """How many cells apart the nodes are, and the places."""

    node_stride: int
    place_stride: int
    cut_corners: bool = False
    """Whether a way may pass between cells that touch at a corner alone, as `reachable` has it."""

    @staticmethod
    def of(stands: Mask, resolution_m: float) -> Lattices:
        """As fine as MOST_NODES and MOST_PLACES allow on the cells where a body can be; places no closer than
        PLACE_SPACING_M, that of the places which `explorable` looks from."""
        cells = np.count_nonzero(stands)
        node = max(1, math.ceil(math.sqrt(cells / MOST_NODES)))
        place = max(
            math.floor(PLACE_SPACING_M / resolution_m + TOUCH), math.ceil(math.sqrt(cells / MOST_PLACES))
        )
        return Lattices(node, math.ceil(place / node) * node)

    def finer(self) -> Lattices | None:
        """What to try where these do not see enough; None if there is nothing left to try."""
        if self.node_stride > 1:
            return replace(self, node_stride=1)
        if not self.cut_corners:
            return replace(self, cut_corners=True)
        return replace(self, place_stride=self.place_stride // 2) if self.place_stride > 1 else None


class Floor:
    """Cells are (ix, iy) of the truth grid with one more cell of wall around it.

    *Nodes* are a lattice of the cells where the body can be, as far as the lattice connects them with the
    start; *places* a coarser one to look from; *samples* explorable cells that stand for all of them. A place
    sees a sample along Bresenham's line, within range, all around, as `sim.truth.explorable` has it.
    """

    def __init__(
        self,
        truth: TruthGrid,
        explorable: Mask,
        start: Pose2,
        body_radius_m: float,
        range_m: float,
        within: Mask | None = None,
    ) -> None:
        """within: the cells that the body's axis may enter, where there is a boundary."""
        self.truth = truth
        self.resolution_m, self.range_m = truth.resolution_m, range_m
        self.reach = (range_m / truth.resolution_m) ** 2 + TOUCH
        self.free, self._wanted = np.pad(~truth.wall, 1), np.pad(explorable, 1)
        ix, iy = truth.cell_of(start)
        self.start = (ix + 1, iy + 1)
        self.stands = _joined(
            np.pad(reachable(truth, start, body_radius_m, within), 1), self.free, self.start
        )
        lattices: Lattices | None = Lattices.of(self.stands, self.resolution_m)
        while lattices is not None:
            self._lay(lattices)
            lattices = lattices.finer() if self.seen_share(self.places) < LEAST_SEEN else None
        self.samples, self.weight = samples_of(self.free, self._wanted, self.places, self.reach)
        self._look()

    def _lay(self, lattices: Lattices) -> None:
        """Lay out nodes and places."""
        from experiments.oracle import floor_kernels as kernels

        self.stride = lattices.node_stride
        if lattices.cut_corners:
            self.stands = _widened(self.stands) & self.free
        on_lattice = np.zeros_like(self.stands)
        x0, y0 = (side % self.stride for side in self.start)
        on_lattice[y0 :: self.stride, x0 :: self.stride] = True  # the start is on it
        nodes, number = _numbered(self.stands & on_lattice)
        around = kernels.neighbours(self.stands, number, nodes, self.stride)
        cost, link = np.empty(len(nodes), np.int32), np.empty(len(nodes), np.int8)
        kernels.flood(around, number[self.start[1], self.start[0], None], cost, link)
        connected = np.zeros_like(self.stands)
        connected[nodes[:, 1], nodes[:, 0]] = cost < kernels.UNREACHED
        self.nodes, self.number = _numbered(connected)
        self.around = kernels.neighbours(self.stands, self.number, self.nodes, self.stride)
        apart = (self.nodes - self.start) % lattices.place_stride == 0
        self.place_nodes = np.flatnonzero(apart.all(axis=1)).astype(np.int32)
        self.places = self.nodes[self.place_nodes]
        self.start_place = int(np.flatnonzero((self.places == self.start).all(axis=1))[0])
        self.nearest_place = self._nearest_places()

    def _look(self) -> None:
        """From every place at every sample."""
        from experiments.oracle import floor_kernels as kernels

        starts, seen = kernels.looks(self.free, self.samples, self.places, self.reach)
        self.sees = Rows(starts, seen)
        self.seen_from = Rows(*kernels.transposed(starts, seen, len(self.samples)))

    def _nearest_places(self) -> Ints:
        """(ny, nx) the place nearest to each cell."""
        numbers = np.full(self.free.shape, -1, np.int32)
        numbers[self.places[:, 1], self.places[:, 0]] = np.arange(len(self.places))
        away = ndimage.distance_transform_edt(numbers < 0, return_distances=False, return_indices=True)
        return numbers[tuple(np.asarray(away))]

    def cells_of(self, points_in_world: Points) -> Ints:
        """(n, 2) metres -> (n, 2) cells."""
        return (self.truth.cell_from_world(points_in_world) + 1).astype(np.int32)

    def world_from(self, cells: Ints) -> Points:
        """(n, 2) cells -> (n, 2) metres, their centres."""
        return self.truth.world_from_cell(cells.astype(np.int64) - 1)

    def seen_share(self, way: Ints) -> float:
        """Share of the explorable area, asked cell by cell, that is in sight of some cell of a way (k, 2)."""
        from experiments.oracle import floor_kernels as kernels

        once = way[np.any(np.diff(way, axis=0, prepend=-1) != 0, axis=1)]
        seen = kernels.cells_seen(self.free, self._wanted, once, self.reach)
        return seen / np.count_nonzero(self._wanted)


def _numbered(mask: Mask) -> tuple[Ints, Ints]:
    """(n, 2) the cells of a mask, and (ny, nx) the number of each, -1 elsewhere."""
    iy, ix = np.nonzero(mask)
    number = np.full(mask.shape, -1, np.int32)
    number[iy, ix] = np.arange(len(ix))
    return np.column_stack((ix, iy)).astype(np.int32), number


def _joined(stands: Mask, free: Mask, start: tuple[int, int]) -> Mask:
    """Where the body can be, and the free cells around a start that is nearer to a wall than the margin."""
    if stands[start[1], start[0]]:
        return stands
    iy, ix = np.nonzero(stands)
    gap = float(np.hypot(ix - start[0], iy - start[1]).min())
    iy, ix = np.indices(stands.shape)
    return stands | (free & (np.hypot(ix - start[0], iy - start[1]) <= gap + 1.5))


def _widened(stands: Mask) -> Mask:
    """With both cells beside every corner at which two cells touch that nothing else joins there."""
    a, b, c, d = stands[:-1, :-1], stands[1:, 1:], stands[:-1, 1:], stands[1:, :-1]
    rising, falling = a & b & ~(c | d), c & d & ~(a | b)
    wide = stands.copy()
    wide[:-1, 1:] |= rising
    wide[1:, :-1] |= rising
    wide[:-1, :-1] |= falling
    wide[1:, 1:] |= falling
    return wide
