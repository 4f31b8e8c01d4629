"""All kernels compiled, or loaded from where they are kept, before the first scan."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from experiments.compiler_memory import let_go_of_compiler
from experiments.config import ExperimentConfig
from experiments.episode import episode
from experiments.experiment import make_explorer, make_robot
from experiments.streams import Streams
from occmap.explorer_config import PaceConfig
from occmap.geometry import Pose2
from occmap.rehearsal import close_loops, garbage_left_alone, rare_moments, settle_a_graph
from occmap.scan import Observation
from sim.building import Box, Building
from sim.faults import FaultsConfig

DRIVE_S = 4.0
"""Long enough to look around, plan and drive."""
EVERY = 8
"""Of the scans of that drive: to close loops takes few."""
OTHER_HALF = "from occmap.rehearsal import compile_aside; compile_aside({pose!r})"
FIRST_ASIDE = {"truth": "planner_kernels.search", "slam": "localization.search_kernels.stamp"}
"""By the pose: a kernel of those that the other process compiles."""


def warm_up(config: ExperimentConfig) -> None:
    """Explore a made-up room for a moment, and go through what happens seldom.

    On a first run a second process compiles meanwhile, from the other end: each loads what the other
    has compiled by then.
    """
    with garbage_left_alone():
        with compiling_aside(config.pose):
            if config.pose == "slam":
                settle_a_graph()  # early, for the other one needs it soon after its drive
            seen = explore(config)
        if config.pose == "slam":
            close_loops(seen[::EVERY])
    let_go_of_compiler()


def explore(config: ExperimentConfig) -> list[Observation]:
    """Explore the room, knowing the pose; what was seen on the way."""
    quick = replace(config.explorer, pace=PaceConfig(first_look_s=0.5))
    config = replace(config, pose="truth", explorer=quick, boundary=(), faults=FaultsConfig())
    robot = make_robot(config, room(), Streams(0))
    explorer = make_explorer(config, robot)
    steps = list(episode(robot, explorer, limit_s=DRIVE_S))
    rare_moments(explorer, steps[-1].decision.map_from_robot)
    return [step.observation for step in steps]


def room() -> Building:
    """A room of 6 m x 4 m, a wall in it."""
    walls = (
        Box(0.0, 2.0, 3.1, 0.1),
        Box(0.0, -2.0, 3.1, 0.1),
        Box(3.0, 0.0, 0.1, 2.0),
        Box(-3.0, 0.0, 0.1, 2.0),
        Box(0.5, 1.0, 0.1, 1.0),
    )
    return Building("warm-up", "plan", (-3.1, -2.1), (3.1, 2.1), walls, Pose2(-1.5, 0.3, 0.2))


@contextmanager
def compiling_aside(pose: str) -> Iterator[None]:
    """While entered, another process compiles kernels into the cache that it shares with this one.

    Only where that helps: on a first run, with a core to spare, and a cache that can be written to. If the
    other one fails, nothing is lost but time: this one compiles what it does not find.
    """
    if not (is_first_run(pose) and (os.cpu_count() or 1) > 1 and multiprocessing.parent_process() is None):
        yield
        return
    path = os.pathsep.join(filter(None, sys.path))
    other = subprocess.Popen(
        [sys.executable, "-c", OTHER_HALF.format(pose=pose)],
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


def is_first_run(pose: str) -> bool:
    """Whether a kernel that the other process would compile is not kept yet, and could be."""
    module, name = FIRST_ASIDE.get(pose, FIRST_ASIDE["truth"]).rsplit(".", 1)
    kernel = getattr(importlib.import_module(f"occmap.{module}"), name)
    cache = Path(str(kernel.stats.cache_path))
    place = next(folder for folder in (cache, *cache.parents) if folder.exists())
    return os.access(place, os.W_OK) and not any(cache.glob(f"{module.rpartition('.')[2]}.{name}-*.nbi"))
