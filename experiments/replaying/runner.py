"""A recorded log through a localizer, and the map that its trajectory makes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Protocol

import numpy as np

from experiments.logs.log import RecordedLog
from experiments.replaying.localizers import (
    MotionFilter,
    PoseSource,
    ReplayLocalizer,
    make_localizer,
    save_slam,
)
from experiments.tum_file import Trajectory
from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization import Estimate
from occmap.localization.undistortion import undistorted
from occmap.mapper import Mapper
from occmap.rehearsal import close_loops, garbage_left_alone
from occmap.scan import Observation, Scan
from occmap.stopwatch import Stopwatch

WARM_UP_SCANS = 80
WARM_UP_LAPS = 3
"""Enough, there and back, for submaps so far apart in time that a loop is looked for between them."""


@dataclass(frozen=True)
class ReplayConfig:
    """How a log is mapped; the defaults are for all logs."""

    pose: PoseSource = "slam"
    """slam: odometry corrected against the map. odometry: where the wheels say, drift and all."""
    no_return_frees_m: float | None = None
    """A beam that met nothing frees so many metres. By default none: in logs it may as well be glass."""
    map: GridConfig = field(default_factory=GridConfig)

    def __post_init__(self) -> None:
        free_m = self.no_return_frees_m
        if free_m is not None and not 0.0 < free_m < math.inf:
            raise ValueError(f"no_return_frees_m must be positive, got {free_m}")


@dataclass(frozen=True)
class ReplayStep:
    """One scan of the log, and where the robot was taken to be when it came in."""

    observation: Observation
    estimate: Estimate


@dataclass(frozen=True)
class Replayed:
    """All that is left of a log when it has been mapped."""

    log: RecordedLog
    poses: tuple[Pose2, ...]
    """map_from_robot at every scan, in the log's order, as known in the end; fewer if interrupted."""
    grid: OccupancyGrid
    stopwatch: Stopwatch

    @property
    def robot(self) -> Trajectory:
        """The robot's poses at the scans' own stamps."""
        return Trajectory.of([seen.time_s for seen in self._observations], list(self.poses))

    @property
    def laser(self) -> Trajectory:
        """map_from_lidar at the scans' own stamps: what the relations benchmark scores."""
        mounts = [seen.robot_from_lidar for seen in self._observations]
        poses = [pose @ mount for pose, mount in zip(self.poses, mounts, strict=True)]
        return Trajectory.of([seen.time_s for seen in self._observations], poses)

    @property
    def path_length_m(self) -> float:
        """Along the corrected poses, scan by scan."""
        return sum(a.distance_to(b) for a, b in pairwise(self.poses))

    @property
    def _observations(self) -> Sequence[Observation]:
        return self.log.observations[: len(self.poses)]


class ReplayRecorder(Protocol):
    """Watches a replay, and never influences it."""

    def record(self, step: ReplayStep) -> None: ...

    def finish(self, poses: Sequence[Pose2], grid: OccupancyGrid) -> None:
        """See what it all came to: the final poses, a scan each, and the map."""
        ...

    def close(self) -> None:
        """Called once, also when the replay was cut short."""
        ...


def replay(
    log: RecordedLog,
    config: ReplayConfig,
    recorders: Sequence[ReplayRecorder] = (),
    stop: Callable[[], bool] = lambda: False,
    localizer: ReplayLocalizer | None = None,
    save_state: Path | None = None,
) -> Replayed:
    """Live through the whole log, or until `stop` says so between two scans; then settle and draw the map.

    A localizer that has seen another log goes on with this one. Its state is saved before it settles, so
    that going on from it is as if it had never been interrupted.
    """
    stopwatch = Stopwatch()
    try:
        with stopwatch.lap("warm_up"):
            warm_up(log.observations, config)
        localizer = localizer or make_localizer(config.pose, config.map)
        scans = 0
        for step in live(log.observations, localizer, stopwatch):
            scans += 1
            with stopwatch.lap("recording"):
                for recorder in recorders:
                    recorder.record(step)
            if stop():
                break
        if save_state is not None:
            save_slam(save_state, localizer)
        with stopwatch.lap("settling"):
            localizer.finish()
        poses = tuple(pose for _, pose in localizer.trajectory()[-scans:])
        with stopwatch.lap("map"):
            grid = localizer.map()
            if config.no_return_frees_m is not None:
                free_no_returns(grid, log.observations, poses, config.no_return_frees_m)
        for recorder in recorders:
            recorder.finish(poses, grid)
    finally:
        for recorder in recorders:
            recorder.close()
    return Replayed(log, poses, grid, stopwatch)


def live(
    observations: Iterable[Observation], localizer: ReplayLocalizer, stopwatch: Stopwatch
) -> Iterator[ReplayStep]:
    """Every scan in turn, as a robot would live through it; each update is a lap of "localization"."""
    for recorded in observations:
        seen = replace(recorded, scan=hits_alone(recorded.scan))
        with stopwatch.lap("localization"):
            estimate = localizer.update(seen)
        yield ReplayStep(seen, estimate)


def warm_up(observations: Sequence[Observation], config: ReplayConfig) -> None:
    """Drive the log's first metres there and back, so that all kernels are loaded before the clock runs.

    Again and again over known ground, because that is where loops are closed.
    """
    motion = MotionFilter(every_m=0.1, every_rad=0.1)
    there = list(
        islice((seen for seen in observations if motion.is_due(seen.odom_from_robot)), WARM_UP_SCANS)
    )
    if len(there) < 2:  # no odometry, or none that moves
        there = list(observations[:WARM_UP_SCANS])
    lap = [*there, *reversed(there[:-1])]
    drive = [replace(seen, time_s=0.2 * k) for k, seen in enumerate(lap * WARM_UP_LAPS)]
    localizer = make_localizer(config.pose, config.map)
    with garbage_left_alone():
        for _ in live(drive, localizer, Stopwatch()):
            pass
        localizer.finish()
        localizer.map()
        if config.pose == "slam":
            close_loops([replace(seen, scan=hits_alone(seen.scan)) for seen in there])


def hits_alone(scan: Scan) -> Scan:
    """The scan without its no-returns: in a log they may be glass, coal or sky, and free nothing."""
    return replace(scan, ranges_m=np.where(np.isinf(scan.ranges_m), np.nan, scan.ranges_m))


def no_returns_alone(scan: Scan, free_m: float) -> Scan:
    """The scan's no-returns, each taken to be free so far; its hits say nothing."""
    ranges = np.where(np.isinf(scan.ranges_m), np.inf, np.nan)
    return Scan(scan.bearings_rad, ranges, free_m, beam_times_s=scan.beam_times_s)


def free_no_returns(
    grid: OccupancyGrid, observations: Sequence[Observation], poses: Sequence[Pose2], free_m: float
) -> None:
    """Spend the no-returns of a log on a map, each taken to be free so far, from where it was cast."""
    mapper, motion = Mapper(), MotionFilter()
    track = list(zip(observations, poses, strict=False))  # fewer poses if interrupted
    for (before, map_from_before), (seen, map_from_robot) in zip(track[:1] + track, track, strict=False):
        if motion.is_due(map_from_robot):
            step, step_s = map_from_before.inverse() @ map_from_robot, seen.time_s - before.time_s
            scan = undistorted(no_returns_alone(seen.scan, free_m), seen.robot_from_lidar, step, step_s)
            mapper.insert(scan, map_from_robot @ seen.robot_from_lidar, grid)
