"""What an oracle needs of a run, from the files that it left."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.boundary_cells import cells_within
from experiments.oracle.floor import Floor
from experiments.tum_file import read_tum
from occmap.geometry import Points, Pose2
from occmap.grid import Belief
from occmap.map_server import load_map
from occmap.pgm import read_pgm
from sim.starts import BODY_RADIUS_M
from sim.truth import Mask, TruthGrid


@dataclass(frozen=True)
class FinishedRun:
    """A run folder, read back."""

    folder: Path
    truth: TruthGrid
    explorable: Mask
    start: Pose2
    range_m: float
    trail: Points  # (n, 2) where the robot truly was, in world
    boundary: tuple[tuple[float, float], ...] = ()

    @property
    def task(self) -> tuple[object, ...]:
        """Runs of the same task started from the same pose in the same building with as far a lidar."""
        wall = self.truth.wall
        return (
            self.start, self.range_m, self.boundary, self.truth.resolution_m, wall.shape, wall.tobytes()
        )  # fmt: skip

    def floor(self) -> Floor:
        """The building as the oracle knows it."""
        within = cells_within(self.boundary, self.truth)
        return Floor(self.truth, self.explorable, self.start, BODY_RADIUS_M, self.range_m, within)


def read_run(folder: Path) -> FinishedRun:
    """ValueError if this is not the folder of a run that has ended."""
    try:
        config = json.loads((folder / "config.json").read_text())
        truth = load_map(folder / "truth.yaml")
        explorable = read_pgm(folder / "explorable.pgm")[::-1] > 0.5
        poses = read_tum(folder / "truth.tum").poses
        range_m = float(config["lidar"]["max_range_m"])
        boundary = tuple((float(x), float(y)) for x, y in config.get("boundary", ()))
        has_closed = config.get("faults", {}).get("close_doors_at_s") is not None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{folder} is not the folder of a run that has ended: {error}") from error
    if has_closed:
        raise ValueError(f"{folder}: doors closed in this run, so that no one way suits its building")
    grid = TruthGrid(truth.resolution_m, truth.origin.position, truth.state == Belief.OCCUPIED)
    return FinishedRun(
        folder, grid, np.ascontiguousarray(explorable), Pose2(*poses[0]), range_m, poses[:, :2], boundary
    )
