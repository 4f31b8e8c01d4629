"""Real floor plans -> Building: Nav2 maps (YAML + image), plain images, and MJCF by way of building_mjcf."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from sim.building import Box, Building
from sim.nav2_map import MapMeta, free_cells, read_image, read_map_yaml
from sim.starts import BODY_RADIUS_M, largest_region, random_start, with_start
from sim.truth import OVERHANG_M, Mask, TruthGrid, configuration_space, connected_parts, truth_grid
from sim.walls import boxes_of

IMAGE_SUFFIXES = (".png", ".pgm", ".bmp", ".jpg", ".jpeg")
MJCF_CELL_M = 0.05
"""Where the robot can start in an MJCF plan, and get out of it, is looked for on cells of this size."""
MARGIN_M = 1.0
"""An image's margin in which nothing is free is cut down to this much: mappers save canvases of 200 m."""
FENCE_M = 1.0
"""An MJCF plan that one could walk or see out of is fenced in this far outside."""
FENCE_HALF_M = 0.05


def load_plan(
    path: str | Path,
    rng: np.random.Generator,
    resolution_m: float | None = None,
    start: Pose2 | None = None,
) -> Building:
    """A building from an MJCF file, a Nav2 map's YAML, or an image whose cells are resolution_m wide.

    The plan's own frame becomes `world`. The robot starts at `start`; else where an MJCF's site of
    that name is; else, by the rng, somewhere in the largest region that the body can move in.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"no plan file at {path}")
    suffix = path.suffix.lower()
    if resolution_m is not None and suffix in (".xml", ".yaml", ".yml"):
        raise ValueError(f"{path} says itself how large it is: leave the resolution of {resolution_m} m out")
    if suffix == ".xml":
        from sim.building_mjcf import load_mjcf

        building, own_start = load_mjcf(path)
        return fenced(placed(building, start or own_start, MJCF_CELL_M, rng))
    if suffix in (".yaml", ".yml"):
        image_path, meta = read_map_yaml(path)
    elif suffix in IMAGE_SUFFIXES:
        if resolution_m is None:
            raise ValueError(f"{path} is an image: say how many metres a pixel is wide (resolution)")
        image_path, meta = path, MapMeta(resolution_m)
    else:
        kinds = ", ".join((".xml (MJCF)", ".yaml (Nav2)", *IMAGE_SUFFIXES))
        raise ValueError(f"{path} is not a plan: give one of {kinds}")
    building = building_of(free_cells(read_image(image_path), meta), meta, path)
    return placed(building, start, meta.resolution_m, rng)


def placed(building: Building, start: Pose2 | None, cell_m: float, rng: np.random.Generator) -> Building:
    """The building with the start that was asked for, or with a random one."""
    if start is not None:
        return with_start(building, start)
    truth = truth_grid(building, cell_m)
    region = largest_region(configuration_space(truth, BODY_RADIUS_M) & within_bounds(building, truth))
    if not region.any():
        raise ValueError(f"plan {building.name!r} leaves no place for a robot of radius {BODY_RADIUS_M} m")
    return with_start(building, random_start(truth, region, rng))


def within_bounds(building: Building, truth: TruthGrid) -> Mask:
    """(ny, nx) cells with their centre in the building; the grid reaches beyond it, where nothing stands."""
    (x0, y0), (ny, nx), r = truth.origin_m, truth.wall.shape, truth.resolution_m
    (low_x, low_y), (high_x, high_y) = building.low_m, building.high_m
    x, y = x0 + (np.arange(nx) + 0.5) * r, y0 + (np.arange(ny) + 0.5) * r
    return ((low_y < y) & (y < high_y))[:, None] & ((low_x < x) & (x < high_x))


def building_of(free: NDArray[np.bool_], meta: MapMeta, path: Path) -> Building:
    """All cells that are not free are solid, and so is everything around the image."""
    if not free.any():
        raise ValueError(f"{path} is all solid: it has no free cell")
    r = meta.resolution_m
    rows, columns = (_with_margin(free, axis, math.floor(MARGIN_M / r)) for axis in (0, 1))
    free = free[rows, columns]
    world_from_image = meta.world_from_image @ Pose2(columns.start * r, rows.start * r, 0.0)
    boxes = boxes_of(np.pad(~free, 1, constant_values=True), r, (-r, -r))
    height_m, width_m = free.shape[0] * r, free.shape[1] * r
    corner_m = 0.5 * max(height_m, width_m) * abs(math.sin(2.0 * world_from_image.yaw_rad))
    if corner_m > 1e-6:  # a turned image leaves corners of the building as deep as that
        boxes += around(width_m, height_m, corner_m + 2.0 * OVERHANG_M)
    corners = world_from_image.apply(np.array([[0, 0], [width_m, 0], [0, height_m], [width_m, height_m]]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Building(
        name=path.stem,
        kind="plan",
        low_m=(float(low[0]), float(low[1])),
        high_m=(float(high[0]), float(high[1])),
        solids=tuple(_moved(box, world_from_image) for box in boxes),
        start=Pose2.identity(),
    )


def _with_margin(mask: NDArray[np.bool_], axis: int, margin: int) -> slice:
    """From the first to the last along an axis with anything in the mask, and so many more, if there are."""
    at = np.flatnonzero(mask.any(axis=1 - axis))
    return slice(max(int(at[0]) - margin, 0), min(int(at[-1]) + 1 + margin, mask.shape[axis]))


def around(width_m: float, height_m: float, deep_m: float) -> tuple[Box, ...]:
    """Four boxes that enclose a rectangle with its lower left corner at the origin."""
    x, y, half_m = 0.5 * width_m, 0.5 * height_m, 0.5 * deep_m
    return (
        Box(x, -half_m, x + deep_m, half_m),
        Box(x, height_m + half_m, x + deep_m, half_m),
        Box(-half_m, y, half_m, y),
        Box(width_m + half_m, y, half_m, y),
    )


def _moved(box: Box, world_from_image: Pose2) -> Box:
    centre = world_from_image @ Pose2(box.x_m, box.y_m, 0.0)
    return replace(box, x_m=centre.x_m, y_m=centre.y_m, yaw_rad=centre.yaw_rad)


def fenced(building: Building) -> Building:
    """The building with a fence some way around it, if one could see or walk out of it from the start."""
    truth = truth_grid(building, MJCF_CELL_M)
    parts = connected_parts(~truth.wall)
    ix, iy = truth.cell_of(building.start)
    if parts[iy, ix] != parts[0, 0]:  # the corner of the grid lies outside
        return building
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    x0, y0, x1, y1 = x0 - FENCE_M, y0 - FENCE_M, x1 + FENCE_M, y1 + FENCE_M
    x, y, half_x, half_y, t = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0), 0.5 * (y1 - y0), FENCE_HALF_M
    fence = (
        Box(x, y0, half_x + t, t),
        Box(x, y1, half_x + t, t),
        Box(x0, y, t, half_y),
        Box(x1, y, t, half_y),
    )
    return replace(building, low_m=(x0 - t, y0 - t), high_m=(x1 + t, y1 + t), solids=building.solids + fence)
