"""The scene of a recording: the building and its doors, the truth to reveal, how everything is styled.

Entities live under `world`; `world/map` carries the robot's map frame, placed by the true start pose,
so that whatever the robot believes is logged in its own coordinates and still overlays the truth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from experiments.recorders import palette
from experiments.recorders.setting import Setting
from occmap.geometry import Pose2
from sim.building import Box, Building, Cylinder
from sim.starts import BODY_RADIUS_M

if TYPE_CHECKING:
    from sim.truth import TruthGrid

FRONTIER_Z_M, TRAIL_Z_M, PATH_Z_M, BEAM_Z_M, TRUTH_Z_M = 0.02, 0.03, 0.04, 0.05, 0.06
"""Layers above the map in drawing order; low, lest a view from above shifts them against it."""

BODY_HEIGHT_M = 0.20
"""Up to the lidar."""


def planar_transform(pose: Pose2) -> rr.Transform3D:
    """A pose of the plane as a transform of space."""
    half = pose.yaw_rad / 2.0
    return rr.Transform3D(
        translation=[pose.x_m, pose.y_m, 0.0],
        quaternion=rr.Quaternion(xyzw=(0.0, 0.0, math.sin(half), math.cos(half))),
    )


def log_scene(rec: rr.RecordingStream, setting: Setting, truth: TruthGrid | None = None) -> None:
    """Log all that does not change during an episode."""
    rec.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    rec.log("world/map", planar_transform(setting.world_from_map), static=True)
    log_building(rec, setting.building)
    if truth is not None:
        log_truth(rec, truth)
    log_robot_body(rec)
    log_styles(rec)


def log_building(rec: rr.RecordingStream, building: Building) -> None:
    """Walls and furniture, an entity or two (boxes, cylinders) a kind."""
    for kind in sorted({solid.kind for solid in building.solids}):
        colour = palette.SOLIDS.get(kind, palette.OTHER_SOLID)
        boxes = [s for s in building.solids if s.kind == kind and isinstance(s, Box)]
        cylinders = [s for s in building.solids if s.kind == kind and isinstance(s, Cylinder)]
        if boxes:
            rec.log(f"world/building/{kind}/boxes", boxes_of(boxes, colour), static=True)
        if cylinders:
            rec.log(f"world/building/{kind}/cylinders", cylinders_of(cylinders, colour), static=True)


def log_doors(rec: rr.RecordingStream, standing: Sequence[tuple[Box, float]]) -> None:
    """Panels as far as each stands out of the floor now; nothing where all doors are open."""
    panels = [replace(panel, height_m=height_m) for panel, height_m in standing]
    rec.log("world/building/doors", boxes_of(panels, palette.DOOR))


def boxes_of(boxes: Sequence[Box], colour: palette.Rgb) -> rr.Boxes3D:
    """Solid boxes that stand on the floor, in `world`."""
    half_yaw = np.array([b.yaw_rad for b in boxes]) / 2.0
    zero = np.zeros_like(half_yaw)
    return rr.Boxes3D(
        centers=[(b.x_m, b.y_m, b.height_m / 2.0) for b in boxes],
        half_sizes=[(b.half_x_m, b.half_y_m, b.height_m / 2.0) for b in boxes],
        quaternions=np.column_stack((zero, zero, np.sin(half_yaw), np.cos(half_yaw))),
        colors=[colour],
        fill_mode=rr.components.FillMode.Solid,
    )


def cylinders_of(cylinders: Sequence[Cylinder], colour: palette.Rgb) -> rr.Cylinders3D:
    """Solid cylinders that stand on the floor, in `world`."""
    return rr.Cylinders3D(
        centers=[(c.x_m, c.y_m, c.height_m / 2.0) for c in cylinders],
        radii=[c.radius_m for c in cylinders],
        lengths=[c.height_m for c in cylinders],
        colors=[colour],
        fill_mode=rr.components.FillMode.Solid,
    )


def log_truth(rec: rr.RecordingStream, truth: TruthGrid) -> None:
    """The true walls as a see-through layer; hidden by the blueprint until somebody wants the answer."""
    image = np.zeros((*truth.wall.shape, 4), np.uint8)
    image[truth.wall[::-1]] = (*palette.TRUTH, 255)  # rows of an image run downwards
    ny, nx = truth.wall.shape
    low_x_m, low_y_m = truth.origin_m
    rec.log(
        "world/truth",
        rr.GridMap(
            data=image.tobytes(),
            format=rr.components.ImageFormat(width=nx, height=ny, color_model="RGBA", channel_datatype="U8"),
            cell_size=truth.resolution_m,
            translation=[low_x_m, low_y_m, TRUTH_Z_M],
            opacity=0.7,  # without it the viewer (0.41) paints transparent pixels black
        ),
        static=True,
    )


def log_robot_body(rec: rr.RecordingStream) -> None:
    """The robot where it believes to be, solid, and a ring where it is; arrows that show from afar."""
    top = [(0.0, 0.0, BODY_HEIGHT_M)]
    body = rr.Cylinders3D(
        centers=[(0.0, 0.0, BODY_HEIGHT_M / 2.0)],
        radii=[BODY_RADIUS_M],
        lengths=[BODY_HEIGHT_M],
        colors=[palette.ROBOT],
        fill_mode=rr.components.FillMode.Solid,
    )
    heading = rr.Arrows3D(
        origins=top, vectors=[(0.9, 0.0, 0.0)], radii=rr.Radius.ui_points(2.5), colors=[palette.ROBOT]
    )
    rec.log("world/map/robot/body", body, static=True)
    rec.log("world/map/robot/heading", heading, static=True)
    turn = np.linspace(0.0, 2.0 * math.pi, 33)
    radius_m = 1.6 * BODY_RADIUS_M
    circle = np.column_stack((radius_m * np.cos(turn), radius_m * np.sin(turn), np.full(33, BODY_HEIGHT_M)))
    ring = rr.LineStrips3D([circle], radii=rr.Radius.ui_points(1.2), colors=[palette.TRUE_ROBOT])
    rec.log("world/true_robot/ring", ring, static=True)


def log_styles(rec: rr.RecordingStream) -> None:
    """Colours and widths, once: later logs carry positions only."""
    for entity, colour, width in (
        ("world/map/path", palette.PATH, 2.0),
        ("world/map/trail", palette.TRAIL, 1.5),
        ("world/true_trail", palette.TRUE_TRAIL, 1.0),
        ("world/map/beams/hit", palette.HIT_RAY, 0.5),
        ("world/map/beams/no_return", palette.NO_RETURN, 0.5),
    ):
        style = rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(width))
        rec.log(entity, style, static=True)
    points = rr.Points3D.from_fields(colors=[palette.HIT], radii=rr.Radius.ui_points(1.5))
    rec.log("world/map/beams/ends", points, static=True)
    goal = rr.Points3D.from_fields(colors=[palette.GOAL], radii=rr.Radius.ui_points(6.0))
    rec.log("world/map/goal", goal, static=True)
    chosen = rr.Points3D.from_fields(colors=[palette.GOAL], radii=rr.Radius.ui_points(3.0))
    rec.log("world/map/chosen_frontier", chosen, static=True)
    for entity, name, colour in (
        ("curves/explored", "explored, %", palette.ROBOT),
        ("curves/path_length", "driven, m", palette.PATH),
        ("curves/pose_error", "pose error, m", palette.GOAL),
        ("curves/wrong_cells", "wrong cells", palette.HIT),
    ):
        rec.log(entity, rr.SeriesLines(names=[name], colors=[colour], widths=[2.0]), static=True)
    names = list(palette.ACTIVITIES)
    colours = [(r << 24) | (g << 16) | (b << 8) | 255 for r, g, b in palette.ACTIVITIES.values()]
    labels = [name.replace("_", " ") for name in names]
    rec.log("activity", rr.StateConfiguration(values=names, labels=labels, colors=colours), static=True)
