"""A building and the robot as one MuJoCo model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco

from sim.building import Box, Building, Door, Solid
from sim.model_files import model_path

COLOURS = {
    "wall": (0.86, 0.84, 0.79, 1.0),
    "furniture": (0.72, 0.52, 0.33, 1.0),
    "column": (0.55, 0.58, 0.62, 1.0),
    "shelf": (0.25, 0.50, 0.55, 1.0),
    "door": (0.80, 0.27, 0.22, 1.0),
}
OTHER_COLOUR = (0.50, 0.47, 0.62, 1.0)
SOLID_BIT = 2
"""The collision bit that the robot's chassis looks for (models/robot.xml)."""


def building_scene(building: Building, closing: Sequence[Door] = ()) -> mujoco.MjSpec:
    """models/scene.xml with the building's solids in its worldbody and the robot at the start.

    Doors that will close are mocap bodies; the height of each is how far its panel stands out of the floor.

    For pictures and for MuJoCo's viewer. Walls belong to the worldbody: one body a wall would cost 30 times
    more a step. World steps a leaner model, which holds only the solids around the robot (see NearWalls).
    """
    spec = mujoco.MjSpec.from_file(str(model_path("scene.xml")))
    for solid in building.solids:
        add_solid(spec.worldbody, solid)
    for number, door in enumerate(closing):
        body = spec.worldbody.add_body(name=f"door_{number}", mocap=True)
        panel = add_solid(body, replace(door.panel, kind="door"))
        # A centimetre lower, so that a panel that is down lies under the floor and not in it.
        panel.pos = [door.panel.x_m, door.panel.y_m, -0.5 * door.panel.height_m - 0.01]
    robot = spec.body("robot")
    robot.pos = [building.start.x_m, building.start.y_m, 0.0]
    robot.quat = yaw_quaternion(building.start.yaw_rad)
    return spec


def add_solid(body: mujoco.MjsBody, solid: Solid) -> mujoco.MjsGeom:
    """One solid, standing on the floor of the body's frame."""
    rgba = COLOURS.get(solid.kind, OTHER_COLOUR)
    half_z = 0.5 * solid.height_m
    if isinstance(solid, Box):
        return body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[solid.half_x_m, solid.half_y_m, half_z],
            pos=[solid.x_m, solid.y_m, half_z],
            quat=yaw_quaternion(solid.yaw_rad),
            contype=SOLID_BIT,
            conaffinity=0,
            rgba=rgba,
        )
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[solid.radius_m, half_z, 0.0],
        pos=[solid.x_m, solid.y_m, half_z],
        contype=SOLID_BIT,
        conaffinity=0,
        rgba=rgba,
    )


def yaw_quaternion(yaw_rad: float) -> list[float]:
    """w, x, y, z of a turn about the vertical."""
    return [math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)]
