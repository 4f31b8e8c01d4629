"""What moves with the robot: poses, trails and beams, sent in columns.

A row of each, several times a second, is most of what a recording logs. Sent as columns about once a
second they cost a quarter of what a call a row does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from experiments.recorders.rerun_blueprint import TIMELINE
from experiments.recorders.rerun_scene import BEAM_Z_M, TRAIL_Z_M
from occmap.geometry import Points, Pose2

if TYPE_CHECKING:
    from experiments.episode import Step

Points32 = NDArray[np.float32]
"""(..., 3) metres."""


def lifted(points: Points, z_m: float) -> Points32:
    """(n, 2) points of the plane as (n, 3) points at one height."""
    out = np.empty((len(points), 3), np.float32)
    out[:, :2] = points
    out[:, 2] = z_m
    return out


class MotionColumns:
    """Collects steps until they are sent.

    Of each scan at most `rays` beams are drawn as lines and at most `hits` as points where they hit;
    beam ends are rounded to `quantum_m`, which makes the file smaller.
    """

    def __init__(self, rays: int, hits: int, quantum_m: float) -> None:
        self._rays = rays
        self._hits = hits
        self._quantum_m = quantum_m
        self._steps: list[Step] = []
        self._before: Step | None = None  # the last step already sent

    def add(self, step: Step) -> None:
        """Remember a step until it is sent; a step's poses and scan never change."""
        self._steps.append(step)

    def send(self, rec: rr.RecordingStream) -> None:
        """Log all steps collected and forget them."""
        if not self._steps:
            return
        times = rr.TimeColumn(TIMELINE, duration=[step.observation.time_s for step in self._steps])
        previous = [self._before or self._steps[0], *self._steps[:-1]]
        for robot, trail, pose_of in (
            ("world/map/robot", "world/map/trail", estimated_pose),
            ("world/true_robot", "world/true_trail", true_pose),
        ):
            poses, before = [pose_of(s) for s in self._steps], [pose_of(s) for s in previous]
            rec.send_columns(robot, [times], transform_columns(poses))
            ends = positions([p for pair in zip(before, poses, strict=True) for p in pair])
            segments = lifted(ends, TRAIL_Z_M).reshape(-1, 2, 3)
            rec.send_columns(trail, [times], rr.LineStrips3D.columns(strips=segments))
        self._send_beams(rec, times)
        self._before = self._steps[-1]
        self._steps = []

    def _send_beams(self, rec: rr.RecordingStream, times: rr.TimeColumn) -> None:
        beams = [self._beams(step) for step in self._steps]
        hits = [ends for ends, _, _ in beams]
        column = rr.Points3D.columns(positions=np.concatenate(hits)).partition([len(h) for h in hits])
        rec.send_columns("world/map/beams/ends", [times], column)
        for k, name in ((1, "hit"), (2, "no_return")):
            strips = [beam[k] for beam in beams]
            column = rr.LineStrips3D.columns(strips=np.concatenate(strips)).partition(
                [len(s) for s in strips]
            )
            rec.send_columns(f"world/map/beams/{name}", [times], column)

    def _beams(self, step: Step) -> tuple[Points32, Points32, Points32]:
        """(h, 3) end points of hits; (k, 2, 3) rays that hit; (m, 2, 3) that met nothing. Map frame."""
        seen, scan = step.observation, step.observation.scan
        map_from_lidar = step.decision.map_from_robot @ seen.robot_from_lidar
        hit, far = scan.is_hit, np.isposinf(scan.ranges_m)
        reach_m = np.where(hit, scan.ranges_m, np.where(far, scan.max_range_m, 0.0))
        along = np.column_stack((reach_m * np.cos(scan.bearings_rad), reach_m * np.sin(scan.bearings_rad)))
        ends = self._quantised(map_from_lidar.apply(along))
        rays = np.empty((len(ends), 2, 3), np.float32)
        rays[:, 0] = self._quantised(np.array([map_from_lidar.position]))
        rays[:, 1] = ends
        drawn = every_so_many(len(ends), self._rays)
        return ends[hit & every_so_many(len(ends), self._hits)], rays[hit & drawn], rays[far & drawn]

    def _quantised(self, points: Points) -> Points32:
        return lifted(np.round(points / self._quantum_m) * self._quantum_m, BEAM_Z_M)


def every_so_many(total: int, most: int) -> NDArray[np.bool_]:
    """(total,) an even choice of at most `most`."""
    chosen = np.zeros(total, bool)
    chosen[:: -(-total // most)] = True
    return chosen


def estimated_pose(step: Step) -> Pose2:
    """In the map frame."""
    return step.decision.map_from_robot


def true_pose(step: Step) -> Pose2:
    """In world."""
    return step.truth.world_from_robot


def positions(poses: list[Pose2]) -> Points:
    """(n, 2) where poses are, in their own frame."""
    return np.array([pose.position for pose in poses])


def transform_columns(poses: list[Pose2]) -> rr.ComponentColumnList:
    """One transform a row."""
    half = np.array([pose.yaw_rad for pose in poses]) / 2.0
    zero = np.zeros_like(half)
    return rr.Transform3D.columns(
        translation=lifted(positions(poses), 0.0),
        quaternion=np.column_stack((zero, zero, np.sin(half), np.cos(half))),
    )
