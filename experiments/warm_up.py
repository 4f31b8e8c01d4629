"""All kernels compiled, or loaded from where they are kept, before the first scan."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from experiments.config import ExperimentConfig
from experiments.episode import episode
from experiments.experiment import make_explorer, make_robot
from experiments.rehearsal import close_loops, garbage_left_alone, rare_moments
from experiments.streams import Streams
from occmap.explorer_config import PaceConfig
from occmap.geometry import Pose2, Twist2
from occmap.scan import Observation
from sim.building import Box, Building

DRIVE_S = 4.0
"""Long enough to look around, plan and drive."""
OTHER_HALF = "from experiments.warm_up import compile_slam; compile_slam()"


def warm_up(config: ExperimentConfig) -> None:
    """Explore a made-up room for a moment, and go through what happens seldom.

    On a first run, a second process compiles slam's kernels meanwhile: they are half of all.
    """
    with garbage_left_alone():
        if config.pose == "slam":
            with compiling_slam_aside():
                seen = explore(config)
            close_loops(seen)
        else:
            explore(config)


def explore(config: ExperimentConfig) -> list[Observation]:
    """Explore the room, knowing the pose; what was seen on the way."""
    quick = replace(config.explorer, pace=PaceConfig(first_look_s=0.5))
    config = replace(config, pose="truth", explorer=quick, boundary=())
    robot = make_robot(config, room(), Streams(0))
    explorer = make_explorer(config, robot)
    steps = list(episode(robot, explorer, limit_s=DRIVE_S))
    rare_moments(explorer, steps[-1].decision.map_from_robot)
    return [step.observation for step in steps]


def compile_slam() -> None:
    """What slam needs, and as little else as can be: drive an arc through the room and close loops."""
    robot = make_robot(ExperimentConfig(pose="truth"), room(), Streams(0))
    seen = []
    for _ in range(30):
        seen.append(robot.sense())
        robot.act(Twist2(0.3, 0.3))
    close_loops(seen)


def room() -> Building:
    """4 m x 6 m and a wall in it."""
    walls = (
        Box(0.0, 2.0, 3.1, 0.1),
        Box(0.0, -2.0, 3.1, 0.1),
        Box(3.0, 0.0, 0.1, 2.0),
        Box(-3.0, 0.0, 0.1, 2.0),
        Box(0.5, 1.0, 0.1, 1.0),
    )
    return Building("warm-up", "plan", (-3.1, -2.1), (3.1, 2.1), walls, Pose2(-1.5, 0.3, 0.2))


@contextmanager
def compiling_slam_aside() -> Iterator[None]:
    """While entered, another process compiles slam's kernels into the cache that it shares with this one.

    Only where that helps: on a first run, with a core to spare, and a cache that can be written to. If the
    other one fails, nothing is lost but time: this one compiles what it does not find.
    """
    if not (is_first_run() and (os.cpu_count() or 1) > 1 and multiprocessing.parent_process() is None):
        yield
        return
    path = os.pathsep.join(filter(None, sys.path))
    other = subprocess.Popen(
        [sys.executable, "-c", OTHER_HALF],
        env=os.environ | {"PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
        other.wait()
    finally:
        other.kill()
        other.wait()


def is_first_run() -> bool:
    """Whether the search's kernel is not kept yet, and could be."""
    from occmap.localization.search_kernels import stamp

    cache = Path(str(stamp.stats.cache_path))
    place = next(folder for folder in (cache, *cache.parents) if folder.exists())
    return os.access(place, os.W_OK) and not any(cache.glob("search_kernels.stamp-*.nbi"))
