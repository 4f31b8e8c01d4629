"""How long a scan takes to be found in the map, beside the same search by brute force in NumPy."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator

import numpy as np

from experiments.benchmarking.figure import Figure
from experiments.config import ExperimentConfig
from experiments.episode import episode
from experiments.experiment import prepare
from occmap.geometry import Points, Pose2
from occmap.localization import SlamLocalizer
from occmap.localization.matcher import Match, Matcher
from occmap.localization.motion import Prediction
from occmap.localization.submap import Submap
from occmap.localization.surfel_map import Cloud
from occmap.localization.window import Window

EVERY = 10
"""Of so many scans one is searched for on purpose, and by the twin: seldom is a search needed."""


class TimedMatcher(Matcher):
    """Notes the CPU seconds of its matches, of the searches in them, and of a twin's."""

    def __init__(self, matcher: Matcher) -> None:
        super().__init__(matcher.config)
        self.match_s: list[float] = []
        self.search_s: list[float] = []
        self.twin_s: list[float] = []

    def match(
        self, cloud: Cloud, submap: Submap, guess: Pose2, prediction: Prediction, usual_fit: float = 0.0
    ) -> Match:
        twins, begun = len(self.twin_s), time.thread_time()
        match = super().match(cloud, submap, guess, prediction, usual_fit)
        spent_s = time.thread_time() - begun
        self.match_s.append(spent_s if len(self.twin_s) == twins else math.nan)  # not with the twin in it
        if len(self.match_s) % EVERY == 0:
            self._track(cloud.points, submap, guess, prediction)
        return match

    def search(
        self,
        points: Points,
        submap: Submap,
        window: Window,
        sigma_m: float = math.inf,
        sigma_rad: float = math.inf,
    ) -> tuple[Pose2, float]:
        begun = time.thread_time()
        found = super().search(points, submap, window, sigma_m, sigma_rad)
        self.search_s.append(time.thread_time() - begun)
        begun = time.thread_time()
        search_by_arrays(points, submap, window)
        self.twin_s.append(time.thread_time() - begun)
        return found


def matching(seed: int) -> Iterator[Figure]:
    """Two minutes of the default office with --pose slam."""
    experiment = prepare(ExperimentConfig(seed=seed, pose="slam"))
    localizer = experiment.explorer.perception.localizer
    assert isinstance(localizer, SlamLocalizer)
    localizer.tracker.matcher = matcher = TimedMatcher(localizer.tracker.matcher)
    deque(episode(experiment.robot, experiment.explorer, limit_s=120.0), maxlen=1)
    warm = slice(len(matcher.match_s) // 10, None)  # the first matches compile
    search_s = float(np.median(matcher.search_s))
    yield Figure("scan matching", 1e3 * float(np.nanmedian(matcher.match_s[warm])), "ms", "0.3")
    yield Figure("  a search, where a scan is not where it was expected", 1e3 * search_s, "ms")
    yield Figure(
        "  its window by brute force in NumPy", float(np.median(matcher.twin_s)) / search_s, "x ours"
    )


def search_by_arrays(points: Points, submap: Submap, window: Window) -> tuple[Pose2, float]:
    """The NumPy twin of Matcher.search, all of the window, without its preference for the guess."""
    raster = submap.raster
    ny, nx = (int(n) for n in raster.shapes[0])
    likelihood = raster.buffer[: ny * nx].reshape(ny, nx)
    turns, reach = window.half_turns, window.half_cells(raster.cell_m)
    shift = np.arange(-reach, reach + 1)
    best, best_score = window.guess, -1.0
    for turn in range(-turns, turns + 1):
        pose = window.pose(turn, 0, 0, raster.cell_m)
        ix, iy = np.floor((pose.apply(points) - raster.origin_m) / raster.cell_m).astype(np.int64).T
        rows = np.clip(iy[:, None] + shift, 0, ny - 1)[:, :, None]
        columns = np.clip(ix[:, None] + shift, 0, nx - 1)[:, None, :]
        scores = likelihood[rows, columns].sum(axis=0, dtype=np.int64)
        k = int(np.argmax(scores))
        if scores.ravel()[k] > best_score:
            dy, dx = (float(shift[n]) * raster.cell_m for n in divmod(k, len(shift)))
            best, best_score = Pose2(pose.x_m + dx, pose.y_m + dy, pose.yaw_rad), float(scores.ravel()[k])
    return best, best_score / (255.0 * len(points))
