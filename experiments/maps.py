"""The maps that a run leaves: what was believed, what is true and what could have been explored."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.grid import Belief, OccupancyGrid
from occmap.map_server import save_map
from occmap.pgm import write_pgm

if TYPE_CHECKING:
    from experiments.scoring import Scorer
    from sim.truth import TruthGrid


def write_maps(grid: OccupancyGrid, scorer: Scorer, folder: Path) -> None:
    """map.*, truth.* (Nav2 maps in the `world` frame) and explorable.pgm (255 explorable, 0 not)."""
    write_belief(grid, scorer.world_from_map, folder / "map")
    write_truth(scorer.truth, folder / "truth")
    write_pgm(folder / "explorable.pgm", np.where(scorer.explorable[::-1], 255, 0).astype(np.uint8))


def write_belief(grid: OccupancyGrid, world_from_map: Pose2, stem: Path) -> None:
    """The part of the map that is known. Its origin carries the yaw of the true start."""
    state, (ix, iy) = cropped(grid.state)
    r = grid.frame.resolution_m
    map_from_corner = Pose2(grid.frame.origin_m[0] + ix * r, grid.frame.origin_m[1] + iy * r, 0.0)
    save_map(stem, state, r, world_from_map @ map_from_corner)


def write_truth(truth: TruthGrid, stem: Path) -> None:
    """Walls occupied, all else free."""
    state = np.where(truth.wall, Belief.OCCUPIED, Belief.FREE).astype(np.uint8)
    save_map(stem, state, truth.resolution_m, Pose2(*truth.origin_m, 0.0))


def cropped(state: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """The smallest box that holds all known cells, and its first cell (ix, iy); one cell if none is known."""
    iy, ix = np.nonzero(state != Belief.UNKNOWN)
    if not len(ix):
        return state[:1, :1], (0, 0)
    return state[iy.min() : iy.max() + 1, ix.min() : ix.max() + 1], (int(ix.min()), int(iy.min()))
