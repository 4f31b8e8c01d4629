"""What a scan costs the map: integration beside a C twin of it, clearance, frontiers."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarking.c_twin import library_of
from experiments.episode import episode
from experiments.experiment import Experiment
from occmap.clearance import ClearanceMap
from occmap.frontiers import FrontierMap
from occmap.geometry import Pose2
from occmap.grid import OccupancyGrid
from occmap.mapper import Mapper
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig

C_SOURCE = Path(__file__).with_name("kernels.c")
PosedScans = Sequence[tuple[Scan, Pose2]]


@dataclass(frozen=True)
class KernelTimes:
    """Medians over the scans of an exploration, in microseconds, all of one and the same run."""

    cells: int
    """Of the whole grid."""
    c_twin_us: float | None
    """The plain loop in C -O3, from end cells to log-odds. None where there is no C compiler."""
    integration_us: float
    """Our kernel: the same, and the states and the list of changes besides."""
    insert_us: float
    """The whole of Mapper.insert, from ranges and pose on."""
    clearance_us: float
    frontiers_us: float
    """The mask of frontier cells."""
    clusters_us: float

    @property
    def integration_over_c(self) -> float | None:
        """How many times as long as the C twin; None without one."""
        return None if self.c_twin_us is None else self.integration_us / self.c_twin_us


def seen_by(experiment: Experiment, scans: int) -> PosedScans:
    """What an exploring robot sees, and from where."""
    steps = islice(episode(experiment.robot, experiment.explorer, limit_s=math.inf), scans)
    return [
        (seen.scan, step.decision.map_from_robot @ seen.robot_from_lidar)
        for step in steps
        for seen in [step.observation]
    ]


def time_kernels(posed_scans: PosedScans, extent_m: float | None = None) -> KernelTimes:
    """Spend every scan twice, on our grid and on that of the C twin, stopping the time of each stage.

    extent_m makes the grid that large a square beforehand.
    """
    mapper, clearance, frontiers, grid = TimedMapper(), ClearanceMap(), FrontierMap(), OccupancyGrid()
    if extent_m is not None:
        grid.grow_to_contain((-extent_m / 2, -extent_m / 2), (extent_m / 2, extent_m / 2))
    twin = CTwin.compiled()
    times = np.empty((len(posed_scans), 6))
    for row, (scan, pose) in zip(times, posed_scans, strict=True):
        moments = [time.perf_counter()]
        change = mapper.insert(scan, pose, grid)
        moments.append(time.perf_counter())
        clearance.update(grid, change)
        moments.append(time.perf_counter())
        frontiers.update(grid, change)
        moments.append(time.perf_counter())
        frontiers.clusters(grid)
        moments.append(time.perf_counter())
        row[:4] = np.diff(moments)
        row[4] = mapper.integration_s
        row[5] = np.nan if twin is None else twin.integrate(mapper, grid)
    warm = times[len(times) // 10 :]  # the first scans compile, and grow the grid
    insert_us, clearance_us, frontiers_us, clusters_us, integration_us, c_us = 1e6 * np.median(warm, axis=0)
    c_twin_us = None if twin is None else float(c_us)
    return KernelTimes(
        grid.state.size, c_twin_us, integration_us, insert_us, clearance_us, frontiers_us, clusters_us
    )


class TimedMapper(Mapper):
    """A mapper that stops the time of its kernel and keeps what it was asked to integrate."""

    def __init__(self, config: SensorModelConfig | None = None) -> None:
        super().__init__(config)
        self.integration_s = 0.0
        self.ends: NDArray[np.int32] = np.empty((0, 2), np.int32)
        self.hit: NDArray[np.uint8] = np.empty(0, np.uint8)

    def _integrate(self, patch, grid, in_window, hit) -> int:
        begun = time.perf_counter()
        changed = super()._integrate(patch, grid, in_window, hit)
        self.integration_s = time.perf_counter() - begun
        corner = np.array([patch.ix0, patch.iy0])
        self.ends = (np.floor(in_window) + corner).astype(np.int32)  # the sensor's cell first
        self.hit = hit.astype(np.uint8)
        return changed


class CTwin:
    """The plain loop in C, on a grid of its own."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self.log_odds = np.empty((0, 0), np.float32)

    @staticmethod
    def compiled() -> CTwin | None:
        """None where there is no compiler."""
        library = library_of(C_SOURCE)
        return None if library is None else CTwin(library)

    def integrate(self, mapper: TimedMapper, grid: OccupancyGrid) -> float:
        """Spend the scan that the mapper has just spent; returns seconds."""
        if self.log_odds.shape != grid.shape:
            self.log_odds = np.zeros(grid.shape, np.float32)
        hit_log_odds, miss_log_odds = mapper.config.increments(grid.config.prior)
        begun = time.perf_counter()
        self._library.integrate(
            ctypes.c_void_p(self.log_odds.ctypes.data),
            ctypes.c_int(grid.shape[1]),
            ctypes.c_void_p(mapper.ends.ctypes.data),
            ctypes.c_void_p(mapper.hit.ctypes.data),
            ctypes.c_int(len(mapper.hit)),
            ctypes.c_float(hit_log_odds),
            ctypes.c_float(miss_log_odds),
            ctypes.c_float(grid.config.clamp),
        )
        return time.perf_counter() - begun
