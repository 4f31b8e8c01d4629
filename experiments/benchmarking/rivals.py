"""What public libraries take for the jobs of our kernels, where they are installed.

None of them is needed to explore. Each works on the whole map: none mends only what a scan has changed.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from occmap.geometry import Points
from occmap.grid import Belief

Job = Callable[[], object]
Rivals = dict[str, Job | None]
"""By name; None where it is not installed."""

EIGHT = np.ones((3, 3), bool)


def installed(module: str) -> Any:
    """The module, or None."""
    return importlib.import_module(module) if find_spec(module) else None


def frontier_rivals(state: NDArray[np.uint8]) -> Rivals:
    """Free cells beside unknown ones, and their 8-connected groups."""
    cv2, measure = installed("cv2"), installed("skimage.measure") if find_spec("skimage") else None

    def mask() -> NDArray[np.bool_]:
        edge = np.zeros(state.shape, bool)
        unknown = state == Belief.UNKNOWN
        edge[1:] |= unknown[:-1]
        edge[:-1] |= unknown[1:]
        edge[:, 1:] |= unknown[:, :-1]
        edge[:, :-1] |= unknown[:, 1:]
        return edge & (state == Belief.FREE)

    return {
        "NumPy and scipy.ndimage.label": lambda: ndimage.label(mask(), EIGHT),
        "OpenCV connectedComponents": None
        if cv2 is None
        else lambda: cv2.connectedComponents(mask().view(np.uint8), connectivity=8),
        "scikit-image label": None if measure is None else lambda: measure.label(mask(), connectivity=2),
    }


def clearance_rivals(state: NDArray[np.uint8]) -> Rivals:
    """The distance from each cell to the nearest occupied one."""
    cv2 = installed("cv2")
    free = (state != Belief.OCCUPIED).astype(np.uint8)
    return {
        "scipy.ndimage.distance_transform_edt": lambda: ndimage.distance_transform_edt(free),
        "OpenCV distanceTransform": None
        if cv2 is None
        else lambda: cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE),
    }


def integration_rivals(
    log_odds: NDArray[np.float32], ends: NDArray[np.int32], hit: NDArray[np.uint8], points: Points
) -> Rivals:
    """One scan into a map: cells (1 + n, 2), the sensor first, which of n are hits, and in metres."""
    octomap = installed("pyoctomap") or installed("octomap")
    rivals: Rivals = {"NumPy": lambda: integrate_by_arrays(log_odds, ends, hit, 0.85, -0.4, 6.0)}
    rivals["OctoMap"] = None
    if octomap is not None:
        tree = octomap.OcTree(0.05)
        cloud, origin = np.column_stack((points, np.zeros(len(points)))), np.zeros(3)
        origin[:2] = points[0]
        rivals["OctoMap"] = lambda: tree.insertPointCloud(cloud[1:], origin)
    return rivals


def integrate_by_arrays(
    log_odds: NDArray[np.float32],
    ends: NDArray[np.int32],
    hit: NDArray[np.uint8],
    hit_log_odds: float,
    miss_log_odds: float,
    clamp: float,
) -> None:
    """The NumPy twin of the plain loop: all beams at once, a step at a time; clamped once a scan."""
    start, last = ends[0].astype(np.float64), ends[1:]
    steps = np.maximum(np.abs(last - ends[0]).max(axis=1), 1)
    beam = np.repeat(np.arange(len(last)), steps)
    step = np.arange(len(beam)) - np.repeat(np.cumsum(steps) - steps, steps)
    way = start + (last[beam] - start) * (step / steps[beam])[:, None]
    cells = np.floor(way + 0.5).astype(np.int64)
    np.add.at(log_odds, (cells[:, 1], cells[:, 0]), np.float32(miss_log_odds))
    np.add.at(log_odds, (last[:, 1], last[:, 0]), np.where(hit, hit_log_odds, miss_log_odds))
    np.clip(log_odds, -clamp, clamp, out=log_odds)


def path_rivals(weights: NDArray[np.float32], start: tuple[int, int], goal: tuple[int, int]) -> Rivals:
    """The cheapest way between two cells (ix, iy) over weights (ny, nx), inf where there is none.

    pyastar2d's diagonal steps cost as much as straight ones: another path than ours.
    """
    pyastar2d = installed("pyastar2d")
    graph = installed("skimage.graph") if find_spec("skimage") else None
    weighed = np.where(np.isinf(weights), -1.0, weights)  # how MCP spells a wall
    ends = start[::-1], goal[::-1]
    return {
        "pyastar2d": None
        if pyastar2d is None
        else lambda: pyastar2d.astar_path(weights, *ends, allow_diagonal=True),
        "scikit-image MCP_Geometric": None
        if graph is None
        else lambda: graph.MCP_Geometric(weighed).find_costs([ends[0]], [ends[1]]),
    }


def milliseconds(rivals: Rivals, repeats: int = 3) -> dict[str, float | None]:
    """The median CPU time of each that is installed; they take turns."""
    spent: dict[str, list[float]] = {name: [] for name in rivals}
    for _ in range(repeats):
        for name, job in rivals.items():
            if job is not None:
                begun = time.thread_time()
                job()
                spent[name].append(1e3 * (time.thread_time() - begun))
    return {name: float(np.median(times)) if times else None for name, times in spent.items()}
