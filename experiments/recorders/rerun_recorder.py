"""recording.rrd: an episode to scrub through in the rerun viewer.

Written while the episode runs: every sync_period_s of simulated time all that was logged is pushed
to the file, so that a process that is killed leaves a recording that opens and lacks at most that.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from experiments.recorders.belief_tiles import BeliefTiles, Tile
from experiments.recorders.frontiers import cells_in_map, chosen_frontier, frontier_colour
from experiments.recorders.rerun_blueprint import TIMELINE, blueprint
from experiments.recorders.rerun_motion import MotionColumns, Points32, lifted
from experiments.recorders.rerun_scene import FRONTIER_Z_M, PATH_Z_M, log_doors, log_scene
from experiments.recorders.setting import Setting

if TYPE_CHECKING:
    from experiments.curves import Sample, ScoreCurve
    from experiments.episode import Step
    from occmap.decision import Decision
    from occmap.frontiers import Frontier
    from sim.truth import TruthGrid


@dataclass(frozen=True)
class RerunConfig:
    """How much of an episode is recorded. Defaults: about 30 MB for ten minutes of a large office."""

    motion_period_s: float = 0.2
    """Poses, trails and beams: smooth enough to watch at ten times real time."""
    map_period_s: float = 1.0
    """Belief and frontiers: the bulk of the bytes."""
    sync_period_s: float = 0.8
    """At most this much simulated time is lost when the process is killed."""
    rays: int = 60
    """At most this many beams of a scan are drawn as lines."""
    hits: int = 180
    """At most this many beams of a scan show where they hit."""
    quantum_m: float = 1.0 / 64.0
    """Beam ends are rounded to this: finer than a cell, and it compresses."""

    def __post_init__(self) -> None:
        for name in ("motion_period_s", "map_period_s", "sync_period_s", "quantum_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if self.rays < 1 or self.hits < 1:
            raise ValueError(f"rays and hits must be at least 1, got {self.rays} and {self.hits}")


class RerunRecorder:
    """Records an episode. The stream is the recorder's own: nothing global is touched."""

    def __init__(
        self,
        path: Path,
        setting: Setting,
        curve: ScoreCurve,
        truth: TruthGrid | None = None,
        config: RerunConfig | None = None,
    ) -> None:
        self.config = config or RerunConfig()
        self._setting = setting
        self._curve = curve
        self._tiles = BeliefTiles()
        self._placed: set[tuple[int, int]] = set()  # tiles whose place is in the file
        self._motion = MotionColumns(self.config.rays, self.config.hits, self.config.quantum_m)
        self._rec = rr.RecordingStream("occmap", recording_id=uuid.uuid4())
        self._rec.save(path, default_blueprint=blueprint(setting.building))
        self._rec.set_log_time_enabled(False)  # the wall clock says nothing about an episode
        self._rec.set_log_tick_enabled(False)
        log_scene(self._rec, setting, truth)
        self._motion_due_s = self._map_due_s = self._sync_due_s = -np.inf
        self._last: Step | None = None
        self._door_heights_m: tuple[float, ...] = ()
        self._sample: Sample | None = None

    def record(self, step: Step) -> None:
        """Log what is due at this step."""
        now_s = step.observation.time_s
        self._rec.set_time(TIMELINE, duration=now_s)
        self._log_decision(step)
        if now_s >= self._motion_due_s:
            self._motion_due_s = now_s + self.config.motion_period_s - 1e-6
            self._motion.add(step)
        if now_s >= self._map_due_s:
            self._map_due_s = now_s + self.config.map_period_s - 1e-6
            self._log_map(step)
        if now_s >= self._sync_due_s:
            self._sync_due_s = now_s + self.config.sync_period_s - 1e-6
            self._sync()
        self._last = step

    def close(self) -> None:
        """Show how it ended and finish the file."""
        if self._last is not None:
            self._motion.add(self._last)
            self._log_map(self._last)
            self._sync()
        self._rec.disconnect()

    def _sync(self) -> None:
        """Push everything on its way to the file."""
        self._motion.send(self._rec)
        self._rec.flush(timeout_sec=0.0)  # starts the push, does not wait for the disk

    def _log_decision(self, step: Step) -> None:
        """What changes now and then: doors, path, goal, activity, events, scores."""
        before = self._last.decision if self._last is not None else None
        now = step.decision
        if step.truth.door_heights_m != self._door_heights_m:
            self._door_heights_m = step.truth.door_heights_m
            log_doors(self._rec, self._setting.standing(self._door_heights_m))
        if before is None or now.path is not before.path:
            waypoints = [] if now.path is None else [lifted(now.path.waypoints_in_map, PATH_Z_M)]
            self._rec.log("world/map/path", rr.LineStrips3D.from_fields(strips=waypoints))
        if before is None or viewpoint(now) != viewpoint(before):
            spot = np.array([viewpoint(now)]) if now.goal else np.empty((0, 2))
            self._rec.log("world/map/goal", rr.Points3D.from_fields(positions=lifted(spot, PATH_Z_M)))
        if before is None or now.activity != before.activity:
            self._rec.log("activity", rr.StateChange(state=now.activity))
        for event in now.events:
            self._rec.log("decisions", rr.TextLog(event, level=rr.TextLogLevel.INFO))
        if now.unknown_left and (before is None or not before.unknown_left):
            self._log_unknown_left(step)
        if self._curve.samples and self._curve.latest is not self._sample:
            self._sample = self._curve.latest
            self._log_sample(self._sample)

    def _log_unknown_left(self, step: Step) -> None:
        for left in step.decision.unknown_left:
            where = f"({left.in_map[0]:z.2f}, {left.in_map[1]:z.2f})"
            line = f"left unknown at {where}: {left.size_m:.2f} m, {left.reason.value}, {left.why}"
            self._rec.log("decisions", rr.TextLog(line, level=rr.TextLogLevel.WARN))

    def _log_sample(self, sample: Sample) -> None:
        for entity, value in (
            ("explored", 100.0 * sample.score.explored),
            ("path_length", sample.path_length_m),
            ("pose_error", round(sample.position_error_m, 4)),
            ("wrong_cells", float(sample.score.wrong_cells)),
        ):
            self._rec.log(f"curves/{entity}", rr.Scalars(value))

    def _log_map(self, step: Step) -> None:
        """The tiles of the belief that changed, and the frontiers."""
        for tile in self._tiles.changed(step.grid):
            self._log_tile(tile, step.grid.frame.resolution_m)
        self._log_frontiers(step)

    def _log_frontiers(self, step: Step) -> None:
        chosen, resolution_m = chosen_frontier(step.decision), step.grid.frame.resolution_m
        others = [f for f in step.decision.frontiers if f is not chosen]
        colours = np.array([frontier_colour(f) for f in others], np.uint8).reshape(-1, 3)
        self._rec.log(
            "world/map/frontiers",
            rr.Points3D.from_fields(
                positions=frontier_points(others, resolution_m),
                colors=np.repeat(colours, [-(-len(f.cells) // 2) for f in others], axis=0),
                radii=0.9 * resolution_m,
            ),
        )
        at = frontier_points([] if chosen is None else [chosen], resolution_m)
        self._rec.log("world/map/chosen_frontier", rr.Points3D.from_fields(positions=at))

    def _log_tile(self, tile: Tile, resolution_m: float) -> None:
        image = tile.image()
        entity = f"world/map/belief/{tile.index[0]}_{tile.index[1]}"
        if tile.index not in self._placed:
            self._placed.add(tile.index)
            self._rec.log(entity, placing(tile, resolution_m), static=True)
        self._rec.log(entity, rr.GridMap.from_fields(data=image.tobytes()))


def placing(tile: Tile, resolution_m: float) -> rr.GridMap:
    """Where a tile lies and how it is read: the same whatever it shows."""
    height, width = tile.state.shape
    return rr.GridMap.from_fields(
        format=rr.components.ImageFormat(width=width, height=height, color_model="L", channel_datatype="U8"),
        cell_size=resolution_m,
        translation=[*tile.low_m, 0.0],
        colormap=rr.components.Colormap.RvizMap,
    )


def viewpoint(decision: Decision) -> tuple[float, float] | None:
    """Where the robot is going to look from, in the map frame."""
    return decision.goal.viewpoint_in_map if decision.goal is not None else None


def frontier_points(frontiers: Sequence[Frontier], resolution_m: float) -> Points32:
    """(n, 3) every second cell of some frontiers: enough to see their shape."""
    centres = [cells_in_map(f, resolution_m)[::2] for f in frontiers]
    return lifted(np.concatenate([np.empty((0, 2)), *centres]), FRONTIER_Z_M)
