"""Where a robot may be put down."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from occmap.geometry import Pose2
from sim.building import Building
from sim.solids import SolidArrays
from sim.truth import Mask, TruthGrid, clearance_m, connected_parts

BODY_RADIUS_M = 0.17
"""Of the chassis in models/robot.xml, which encloses all that could touch a wall."""
ELBOW_ROOM_M = 0.35
"""A random start keeps this far from solids, where the building has such places."""
ALIGNED_RAD = math.radians(8.0)
"""A random start is turned at least this far away from the axes: walls then cross the cells askew."""


def with_start(building: Building, start: Pose2) -> Building:
    """The same building, entered elsewhere; an error if the body does not fit there."""
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    place = f"the start ({start.x_m:.2f}, {start.y_m:.2f})"
    if not (x0 < start.x_m < x1 and y0 < start.y_m < y1):
        raise ValueError(f"{place} is outside of the building, which spans ({x0}, {y0}) to ({x1}, {y1})")
    nearest_m = float(np.min(SolidArrays.of(building.solids).distance_m(*start.position), initial=math.inf))
    if nearest_m <= 0.0:
        raise ValueError(f"{place} is inside a wall: choose a place on free floor")
    if nearest_m < BODY_RADIUS_M:
        raise ValueError(
            f"{place} is {nearest_m:.2f} m from a solid, but the robot's radius is {BODY_RADIUS_M:.2f} m: "
            "move it away from walls and furniture"
        )
    return replace(building, start=start)


def random_start(truth: TruthGrid, region: Mask, rng: np.random.Generator) -> Pose2:
    """A place in the region, clear of solids if it can be, and a heading that no wall is aligned with."""
    clear = clearance_m(truth.wall, truth.resolution_m) > ELBOW_ROOM_M
    cells = np.argwhere(region & clear)
    if not len(cells):
        cells = np.argwhere(region)
    iy, ix = cells[rng.integers(len(cells))]
    x_m, y_m = truth.world_from_cell(np.array([[ix, iy]]))[0]
    quarter = int(rng.integers(4)) * 0.5 * math.pi - math.pi
    yaw = quarter + rng.uniform(ALIGNED_RAD, 0.5 * math.pi - ALIGNED_RAD)
    return Pose2(round(float(x_m), 6), round(float(y_m), 6), round(yaw, 6))


def largest_region(space: Mask) -> Mask:
    """The largest connected part (8-neighbours) of a configuration space; nothing if it is empty."""
    if not space.any():
        return space
    labels = connected_parts(space)
    return labels == 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
