"""recording.rrd of a replayed log: the map as it grew, beams, trail, and what the path was corrected to."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.recorders import palette
from experiments.recorders.belief_tiles import BeliefTiles, Tile
from experiments.recorders.rerun_blueprint import looking_down, whole_run
from experiments.recorders.rerun_motion import lifted
from experiments.recorders.rerun_scene import (
    BEAM_Z_M,
    TRAIL_Z_M,
    log_robot_body,
    log_styles,
    planar_transform,
)
from experiments.replaying.runner import ReplayStep
from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.mapper import Mapper

TIMELINE = "log_time"
"""Seconds since the log's first scan."""


@dataclass(frozen=True)
class RerunReplayConfig:
    """How much of a replay is recorded. Defaults: some 25 MB for 45 minutes."""

    motion_period_s: float = 0.4
    """Poses, trails and beams."""
    map_period_s: float = 2.0
    """The belief: the bulk of the bytes."""
    sync_period_s: float = 10.0
    """At most so much of the log is lost when the process is killed; a replay runs many times real time."""
    quantum_m: float = 1.0 / 64.0
    """Beam ends are rounded to this: finer than a cell, and it compresses."""


class RerunReplay:
    """Draws its own live map, so that a replay that is not recorded need not."""

    def __init__(self, path: Path, grid: GridConfig, config: RerunReplayConfig | None = None) -> None:
        self.config = config or RerunReplayConfig()
        self._grid, self._mapper, self._tiles = OccupancyGrid(grid), Mapper(), BeliefTiles()
        self._rec = rr.RecordingStream("occmap replay", recording_id=uuid.uuid4())
        self._rec.save(path, default_blueprint=blueprint((-15.0, -15.0), (15.0, 15.0)))
        self._rec.set_log_time_enabled(False)
        self._rec.set_log_tick_enabled(False)
        self._rec.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        log_robot_body(self._rec)
        log_styles(self._rec)
        self._begun_s: float | None = None
        self._motion_due_s = self._map_due_s = self._sync_due_s = -np.inf
        self._map_from_odom: Pose2 | None = None
        self._at: Pose2 | None = None  # where the trail ends

    def record(self, step: ReplayStep) -> None:
        """Take the scan into the live map, and log what is due."""
        seen, estimate = step.observation, step.estimate
        if self._begun_s is None:
            self._begun_s = seen.time_s
            self._map_from_odom = estimate.map_from_robot @ seen.odom_from_robot.inverse()
        now_s = seen.time_s - self._begun_s
        self._rec.set_time(TIMELINE, duration=now_s)
        if estimate.grid is not None:
            self._grid = estimate.grid
            self._rec.log("events", rr.TextLog("the map was built anew from corrected poses"))
        if estimate.insert:
            map_from_lidar = estimate.map_from_robot @ seen.robot_from_lidar
            self._mapper.insert(estimate.scan or seen.scan, map_from_lidar, self._grid)
        if now_s >= self._motion_due_s:
            self._motion_due_s = now_s + self.config.motion_period_s
            self._log_motion(step)
        if now_s >= self._map_due_s:
            self._map_due_s = now_s + self.config.map_period_s
            self._log_map()
        if now_s >= self._sync_due_s:
            self._sync_due_s = now_s + self.config.sync_period_s
            self._rec.flush(timeout_sec=0.0)  # starts the push, does not wait for the disk

    def finish(self, poses: Sequence[Pose2], grid: OccupancyGrid) -> None:
        """The final map, and the whole path as it was corrected in the end."""
        self._grid = grid
        self._log_map()
        path = lifted(np.array([pose.position for pose in poses]).reshape(-1, 2), BEAM_Z_M)
        self._rec.log(
            "world/map/final_trail",
            rr.LineStrips3D([path], colors=[palette.GOAL], radii=rr.Radius.ui_points(1.5)),
        )
        self._rec.log("world/map/trail", rr.Clear(recursive=False))
        iy, ix = np.nonzero(grid.state)
        if len(ix):
            centres = grid.frame.map_from_cell(np.column_stack((ix, iy)))
            low, high = centres.min(axis=0), centres.max(axis=0)
            shown = blueprint((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))
            self._rec.send_blueprint(shown, make_active=False, make_default=True)

    def close(self) -> None:
        """Finish the file."""
        self._rec.disconnect()

    def _log_motion(self, step: ReplayStep) -> None:
        """Robot, trail, beams, and how far the wheels are from the estimate by now."""
        seen, map_from_robot = step.observation, step.estimate.map_from_robot
        self._rec.log("world/map/robot", planar_transform(map_from_robot))
        if self._at is not None:
            ends = lifted(np.array([self._at.position, map_from_robot.position]), TRAIL_Z_M)
            self._rec.log("world/map/trail", rr.LineStrips3D.from_fields(strips=[ends]))
        self._at = map_from_robot
        hits = (map_from_robot @ seen.robot_from_lidar).apply(seen.scan.hits_in_lidar())
        rounded = np.round(hits / self.config.quantum_m) * self.config.quantum_m
        self._rec.log("world/map/beams/ends", rr.Points3D.from_fields(positions=lifted(rounded, BEAM_Z_M)))
        assert self._map_from_odom is not None, "set at the first scan"
        drift_m = map_from_robot.distance_to(self._map_from_odom @ seen.odom_from_robot)
        self._rec.log("curves/odometry_drift", rr.Scalars(drift_m))

    def _log_map(self) -> None:
        for tile in self._tiles.changed(self._grid):
            self._rec.log(
                f"world/map/belief/{tile.index[0]}_{tile.index[1]}",
                grid_map(tile, self._grid.frame.resolution_m),
            )


def blueprint(low_m: tuple[float, float], high_m: tuple[float, float]) -> rrb.Blueprint:
    """The map from above, and the curve of the odometry's error below it."""
    x_m, y_m = (low_m[0] + high_m[0]) / 2.0, (low_m[1] + high_m[1]) / 2.0
    span_m = max(high_m[1] - low_m[1], (high_m[0] - low_m[0]) / 1.8)
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Spatial3DView(
                name="Belief: white free, black wall, grey unknown; magenta the final path",
                origin="/world",
                contents=["+ $origin/**", "- $origin/true_robot/**"],
                background=palette.UNKNOWN,
                line_grid=False,
                eye_controls=looking_down(x_m, y_m, 1.05 * span_m),
                overrides={"/world/map/trail": [past()]},
            ),
            rrb.TimeSeriesView(
                name="odometry's distance from the estimate, m",
                origin="/curves",
                axis_x=whole_run(),
                plot_legend=rrb.PlotLegend(visible=False),
            ),
            row_shares=[5, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, playback_speed=20.0),
        collapse_panels=True,
    )


def past() -> rrb.VisibleTimeRanges:
    """A trail is a segment a step, all of them up to the cursor in sight."""
    return rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )


def grid_map(tile: Tile, resolution_m: float) -> rr.GridMap:
    """A tile in rviz's colours."""
    image = tile.image()
    return rr.GridMap(
        data=image.tobytes(),
        format=rr.components.ImageFormat(
            width=image.shape[1], height=image.shape[0], color_model="L", channel_datatype="U8"
        ),
        cell_size=resolution_m,
        translation=[*tile.low_m, 0.0],
        colormap=rr.components.Colormap.RvizMap,
    )
