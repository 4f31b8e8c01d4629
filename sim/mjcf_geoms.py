"""Static MuJoCo geoms at lidar height -> upright solids."""

from __future__ import annotations

import math
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.building import Box, Cylinder, Solid
from sim.truth import LIDAR_HEIGHT_M

UPRIGHT = 1.0 - 1e-9
"""Cosine of the tilt below which a geom counts as standing upright."""
YAW_DIGITS = 12
"""An angle comes back from MuJoCo's quaternions with its last bits shaken."""
REFUSED = {
    mujoco.mjtGeom.mjGEOM_MESH: "a mesh",
    mujoco.mjtGeom.mjGEOM_HFIELD: "a height field",
    mujoco.mjtGeom.mjGEOM_SDF: "a signed distance field",
    mujoco.mjtGeom.mjGEOM_PLANE: "a plane that is not level",
}


def static_solids(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Solid, ...]:
    """All solids among the geoms that no joint moves; data must hold the kinematics."""
    found = []
    for geom in range(model.ngeom):
        if model.body_weldid[model.geom_bodyid[geom]] != 0:
            continue
        low_m, high_m = _height_of(model, data, geom)
        if low_m < LIDAR_HEIGHT_M < high_m:
            found.append(_solid(model, data, geom, high_m))
    return tuple(found)


def yaw_of(rotation: NDArray[np.float64]) -> float:
    """The heading of the x axis of a rotation matrix (9,)."""
    return round(math.atan2(float(rotation[3]), float(rotation[0])), YAW_DIGITS)


def _height_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[float, float]:
    """From where to where a geom reaches above the floor; a tilted one's box may reach a little further.

    A level plane, a floor or a ceiling, has one height; any other reaches everywhere.
    """
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
        is_level, z = abs(data.geom_xmat[geom, 8]) > UPRIGHT, float(data.geom_xpos[geom, 2])
        return (z, z) if is_level else (-math.inf, math.inf)
    z = _corners(model, data, geom)[:, 2]
    return float(z.min()), float(z.max())


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> NDArray[np.float64]:
    """(8, 3) world corners of the geom's own bounding box."""
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    local = centre + np.array(list(product((-1.0, 1.0), repeat=3))) * half
    return local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def _solid(model: mujoco.MjModel, data: mujoco.MjData, geom: int, height_m: float) -> Solid:
    shape, name = mujoco.mjtGeom(model.geom_type[geom]), model.geom(geom).name
    if shape in REFUSED:
        raise ValueError(
            f"geom {name or geom!r} is {REFUSED[shape]} at the lidar's height: "
            "a plan is made of boxes, cylinders, capsules, spheres and ellipsoids"
        )
    kind = _kind_of(name)
    x, y = float(data.geom_xpos[geom, 0]), float(data.geom_xpos[geom, 1])
    size, rotation = model.geom_size[geom], data.geom_xmat[geom]
    is_upright = abs(float(rotation[8])) > UPRIGHT
    if shape == mujoco.mjtGeom.mjGEOM_SPHERE or (
        is_upright and shape in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE)
    ):
        return Cylinder(x, y, float(size[0]), height_m, kind)
    if is_upright and shape == mujoco.mjtGeom.mjGEOM_BOX:
        return Box(x, y, float(size[0]), float(size[1]), yaw_of(rotation), height_m, kind)
    return _box_around(_corners(model, data, geom)[:, :2], rotation.reshape(3, 3), height_m, kind)


def _box_around(
    corners: NDArray[np.float64], rotation: NDArray[np.float64], height_m: float, kind: str
) -> Box:
    """The upright box around a tilted geom's corners (8, 2), turned with its most level axis."""
    level = int(np.argmax(np.hypot(rotation[0], rotation[1])))
    yaw = math.atan2(rotation[1, level], rotation[0, level])
    along = np.array([math.cos(yaw), math.sin(yaw)])
    axes = np.array([along, [-along[1], along[0]]])
    inside = corners @ axes.T
    low, high = inside.min(axis=0), inside.max(axis=0)
    x, y = (0.5 * (low + high)) @ axes
    half_x, half_y = 0.5 * (high - low)
    return Box(float(x), float(y), float(half_x), float(half_y), round(yaw, YAW_DIGITS), height_m, kind)


def _kind_of(name: str) -> str:
    """`shelf_12` is a shelf; anything that is not named so is a wall."""
    kind, _, number = name.rpartition("_")
    return kind if kind and number.isdigit() else "wall"
