"""What a scan costs the map and its layers, beside a C twin, a NumPy twin and public libraries."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from experiments.benchmarking.figure import Figure, compared
from experiments.benchmarking.kernels import PosedScans, TimedMapper, seen_by, time_kernels
from experiments.benchmarking.rivals import (
    clearance_rivals,
    frontier_rivals,
    integration_rivals,
    milliseconds,
)
from experiments.config import ExperimentConfig
from experiments.experiment import prepare
from occmap.grid import OccupancyGrid

SIDES_M = (40.0, 100.0, 200.0)
"""The same scans on maps of these sizes: what follows a scan's changes must not grow with them."""


def layers(seed: int) -> Iterator[Figure]:
    """The scans with which an exploration of the default office begins."""
    scans = seen_by(prepare(ExperimentConfig(seed=seed, pose="truth")), 600)
    yield from integration(scans)
    for side_m in SIDES_M:
        times = time_kernels(scans, side_m)
        yield Figure(f"clearance, map of {side_m:.0f} m", times.clearance_us, "us a scan", "300")
        frontiers_us = times.frontiers_us + times.clusters_us
        yield Figure(f"frontiers, map of {side_m:.0f} m", frontiers_us, "us a scan", "250")
        if side_m == SIDES_M[0]:
            state = mapped(scans, side_m)[0].state
            yield from compared(1e-3 * times.clearance_us, milliseconds(clearance_rivals(state)))
            yield from compared(1e-3 * frontiers_us, milliseconds(frontier_rivals(state)))


def integration(scans: PosedScans) -> Iterator[Figure]:
    """Votes into belief, from the cells in which beams end."""
    times = time_kernels(scans)
    yield Figure("scan integration", times.integration_us, "us a scan")
    yield Figure("the same loop in C -O3", times.c_twin_us, "us a scan", "about 70")
    yield Figure("integration / C", times.integration_over_c, "", "1.0")
    grid, mapper = mapped(scans)
    scan, map_from_lidar = scans[-1]
    ends_m = map_from_lidar.apply(scan.hits_in_lidar())
    points = np.vstack((map_from_lidar.position, ends_m))
    rivals = integration_rivals(grid.log_odds, mapper.ends, mapper.hit, points)
    yield from compared(1e-3 * times.integration_us, milliseconds(rivals))
    yield Figure("insert, from ranges and pose on", times.insert_us, "us a scan")


def mapped(scans: PosedScans, side_m: float | None = None) -> tuple[OccupancyGrid, TimedMapper]:
    """The map of all scans, on a square of that side if it is given, and the mapper after the last."""
    grid, mapper = OccupancyGrid(), TimedMapper()
    if side_m is not None:
        grid.grow_to_contain((-side_m / 2, -side_m / 2), (side_m / 2, side_m / 2))
    for scan, map_from_lidar in scans:
        mapper.insert(scan, map_from_lidar, grid)
    return grid, mapper
