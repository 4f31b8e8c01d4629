"""The truth: where walls are at lidar height, and what of the floor a robot could come to see.

For scoring and for checking buildings only. Nothing that a robot decides may depend on it.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.geometry import Points, Pose2
from sim.building import Box, Building, Solid

Mask = NDArray[np.bool_]
"""(ny, nx) one answer a cell, `a[iy, ix]`, row 0 at the lowest y."""

LIDAR_HEIGHT_M = 0.20
"""Where the lidar's plane lies: what ends below it is no wall to the robot's eyes."""
MARGIN_M = 0.05
"""A gap counts as passable only if it leaves this much beside the body."""
PLACE_SPACING_M = 0.25
"""The robot is imagined to look around from a lattice of places this far apart."""
OVERHANG_M = 0.5
"""What of a solid is farther outside of the building's bounds is not drawn: nobody gets there."""
MOST_CELLS = 250_000_000
"""Of a building: 790 m x 790 m at 5 cm. More would take tens of gigabytes."""
TOUCH = 1e-6
"""In cells: a solid that ends on a cell's border does not touch that cell."""


def connected_parts(mask: Mask) -> NDArray[np.int32]:
    """(ny, nx) the number of each cell's 8-connected part, counted from 1; 0 outside of the mask."""
    labels: Any = ndimage.label(mask, np.ones((3, 3), bool))
    return np.asarray(labels[0], np.int32)


def grown(mask: Mask) -> Mask:
    """Cells of the mask and their 8 neighbours."""
    return _spread(_spread(mask, axis=0), axis=1)


def _spread(mask: Mask, axis: int) -> Mask:
    out = mask.copy()
    rows, spread = np.moveaxis(mask, axis, 0), np.moveaxis(out, axis, 0)
    spread[1:] |= rows[:-1]
    spread[:-1] |= rows[1:]
    return out


def clearance_m(wall: Mask, resolution_m: float) -> NDArray[np.float64]:
    """From each cell's centre to the nearest wall cell's, less half a cell, as the robot's own map has it."""
    if not wall.any():
        return np.full(wall.shape, math.inf)
    return np.asarray(ndimage.distance_transform_edt(~wall)) * resolution_m - 0.5 * resolution_m


@dataclass(frozen=True)
class TruthGrid:
    """Cells that any solid touches at lidar height, in the `world` frame."""

    resolution_m: float
    origin_m: tuple[float, float]
    """The lower-left corner of cell (0, 0)."""
    wall: Mask

    def cell_from_world(self, points: Points) -> NDArray[np.int64]:
        """(n, 2) metres -> (n, 2) cells (ix, iy). Floors."""
        return np.floor((points - np.asarray(self.origin_m)) / self.resolution_m).astype(np.int64)

    def world_from_cell(self, cells: NDArray[np.int64]) -> Points:
        """(n, 2) cells (ix, iy) -> (n, 2) metres, the cells' centres."""
        return np.asarray((cells + 0.5) * self.resolution_m + np.asarray(self.origin_m), np.float64)

    def cell_of(self, pose: Pose2) -> tuple[int, int]:
        """The cell (ix, iy) that a pose stands in; an error if that is outside of the grid."""
        ix, iy = self.cell_from_world(np.array([pose.position]))[0]
        ny, nx = self.wall.shape
        if not (0 <= ix < nx and 0 <= iy < ny):
            raise ValueError(f"({pose.x_m:.2f}, {pose.y_m:.2f}) is outside of the building")
        return int(ix), int(iy)


def truth_grid(building: Building, resolution_m: float, closed_doors: Collection[int] = ()) -> TruthGrid:
    """A wall in every cell that a solid touches; the doors named by index are closed, the others open.

    The lattice is aligned with the building's lower-left corner, so that a plan's own raster comes
    back exactly at its resolution, and reaches at least one cell beyond the bounds on every side, and
    beyond the solids that overhang them, but for what is more than OVERHANG_M outside.
    """
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        raise ValueError(f"resolution_m must be positive, got {resolution_m}")
    low, high = np.array(building.low_m), np.array(building.high_m)
    solids = [s for s in building.solids if s.height_m > LIDAR_HEIGHT_M]
    solids += [building.doors[k].panel for k in sorted(closed_doors)]
    bounds = np.array([s.bounds() for s in solids]).reshape(-1, 4)
    overhang_low = min(float(np.max(low - bounds[:, :2], initial=0.0)), OVERHANG_M)
    overhang_high = min(float(np.max(bounds[:, 2:] - high, initial=0.0)), OVERHANG_M)
    pad = 1 + math.ceil(overhang_low / resolution_m - TOUCH)
    beyond = 1 + math.ceil(overhang_high / resolution_m - TOUCH)
    width_m, height_m = (high - low).tolist()
    spans = f"the building spans {width_m:g} m x {height_m:g} m"
    if resolution_m > min(width_m, height_m):
        raise ValueError(f"{spans}: cells of {resolution_m} m are too large for it")
    if width_m * height_m > MOST_CELLS * resolution_m**2:
        raise ValueError(
            f"{spans}: more than {MOST_CELLS} cells of {resolution_m} m; is the unit of a plan, "
            "or a resolution, mistaken?"
        )
    nx, ny = (pad + beyond + math.ceil(side / resolution_m - TOUCH) for side in (width_m, height_m))
    truth = TruthGrid(
        resolution_m,
        (float(low[0] - pad * resolution_m), float(low[1] - pad * resolution_m)),
        np.zeros((ny, nx), bool),
    )
    for solid, extent in zip(solids, bounds, strict=True):
        _draw(truth, solid, extent)
    return truth


def _draw(truth: TruthGrid, solid: Solid, bounds: NDArray[np.float64]) -> None:
    """Mark the cells whose inside meets the solid's: separating axes for boxes, distance for cylinders."""
    r = truth.resolution_m
    ix0, iy0 = np.maximum(np.floor((bounds[:2] - truth.origin_m) / r + TOUCH).astype(int), 0)
    ix1, iy1 = np.maximum(np.ceil((bounds[2:] - truth.origin_m) / r - TOUCH).astype(int), 0)
    cells = truth.wall[iy0:iy1, ix0:ix1]
    if isinstance(solid, Box) and solid.yaw_rad == 0.0:
        cells[:] = True
        return
    ny, nx = cells.shape
    dx = ((np.arange(ix0, ix0 + nx) + 0.5) * r + truth.origin_m[0] - solid.x_m)[None, :]
    dy = ((np.arange(iy0, iy0 + ny) + 0.5) * r + truth.origin_m[1] - solid.y_m)[:, None]
    if isinstance(solid, Box):
        c, s = math.cos(solid.yaw_rad), math.sin(solid.yaw_rad)
        half_cell = 0.5 * r * (abs(c) + abs(s)) - TOUCH * r
        along, across = np.abs(c * dx + s * dy), np.abs(c * dy - s * dx)
        cells |= (along < solid.half_x_m + half_cell) & (across < solid.half_y_m + half_cell)
    else:
        gap = np.hypot(np.maximum(np.abs(dx) - 0.5 * r, 0.0), np.maximum(np.abs(dy) - 0.5 * r, 0.0))
        cells |= gap < solid.radius_m - TOUCH * r


def configuration_space(truth: TruthGrid, body_radius_m: float) -> Mask:
    """Cells on whose centre a circle of the body's radius plus MARGIN_M touches no wall."""
    return clearance_m(truth.wall, truth.resolution_m) >= body_radius_m + MARGIN_M - TOUCH


def reachable(truth: TruthGrid, start: Pose2, body_radius_m: float, within: Mask | None = None) -> Mask:
    """The part of the configuration space that is connected with the start (8-neighbours).

    A start nearer to a wall than the margin belongs to the nearest place within a body's radius
    of it; one without any such place reaches nothing but its own cell. The body's axis stays within
    a mask of cells, if one is given.
    """
    space = configuration_space(truth, body_radius_m)
    if within is not None:
        space &= within
    labels = connected_parts(space)
    ix, iy = truth.cell_of(start)
    label = labels[iy, ix] or _label_near(labels, ix, iy, math.ceil(body_radius_m / truth.resolution_m))
    if label:
        return labels == label
    alone = np.zeros_like(space)
    alone[iy, ix] = True
    return alone


def _label_near(labels: NDArray[np.int32], ix: int, iy: int, radius: int) -> int:
    """The label of the nearest labelled cell within radius cells, 0 if there is none."""
    y0, x0 = max(0, iy - radius), max(0, ix - radius)
    jy, jx = np.nonzero(labels[y0 : iy + radius + 1, x0 : ix + radius + 1])
    if not len(jx):
        return 0
    nearest = np.argmin((jx + x0 - ix) ** 2 + (jy + y0 - iy) ** 2)
    return int(labels[jy[nearest] + y0, jx[nearest] + x0])


def explorable(
    truth: TruthGrid, start: Pose2, body_radius_m: float, range_m: float, within: Mask | None = None
) -> Mask:
    """Every free cell in line of sight and range of a place that the body can reach from the start.

    Places are the start and the reachable cells on a lattice of PLACE_SPACING_M. A cell sees a place
    if all cells of Bresenham's line from it to the place are free. Where a mask of cells is given, both
    the places and what is seen from them are within it.
    """
    from sim import truth_kernels  # numba: only when the truth is asked for

    ix, iy = truth.cell_of(start)
    if truth.wall[iy, ix]:
        raise ValueError(f"the start ({start.x_m:.2f}, {start.y_m:.2f}) is inside a wall")
    stride = max(1, math.floor(PLACE_SPACING_M / truth.resolution_m + TOUCH))
    places = np.ascontiguousarray(reachable(truth, start, body_radius_m, within)[::stride, ::stride])
    labels = connected_parts(~truth.wall)
    candidate = labels == labels[iy, ix]  # a line of sight is a chain of free cells
    if within is not None:
        candidate &= within
    reach = (range_m / truth.resolution_m) ** 2 + TOUCH
    return truth_kernels.cells_in_sight(~truth.wall, candidate, places, stride, ix, iy, reach)


def rim(wall: Mask) -> Mask:
    """Free cells within one cell (8-neighbourhood) of a wall: there either answer counts."""
    return grown(wall) & ~wall


def surface(wall: Mask, explorable: Mask) -> Mask:
    """Wall cells within one cell (8-neighbourhood, as the rim) of an explorable one."""
    return wall & grown(explorable)


def building_summary(building: Building, truth: TruthGrid) -> dict[str, Any]:
    """What kind of building it is, as plain numbers; the free area is the floor connected with the start."""
    labels = connected_parts(~truth.wall)
    ix, iy = truth.cell_of(building.start)
    free = np.count_nonzero(labels == labels[iy, ix]) * truth.resolution_m**2
    return {
        "kind": building.kind,
        "size_m": [round(h - lo, 3) for lo, h in zip(building.low_m, building.high_m, strict=True)],
        "rooms": len(building.rooms),
        "doors": len(building.doors),
        "obstacles": sum(s.kind != "wall" for s in building.solids),
        "free_area_m2": round(float(free), 2),
    }
