"""The relations metric: how well a trajectory keeps the true relations between pairs of poses.

Kümmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, 2009, section 3.
For each relation (t1, t2, delta_ref) the error is

    delta_ref^-1 @ (pose(t1)^-1 @ pose(t2))

and translation and rotation are summed up apart, so that no common frame and no weight is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.error_statistics import Statistics
from experiments.number_rows import read_rows
from experiments.planar import Poses, between
from experiments.tum_file import Trajectory

STAMP_TOLERANCE_S = 1e-4
"""Stamps are the log's own; this only bridges their rounding."""


@dataclass(frozen=True)
class Relations:
    """True relations between the laser's poses at pairs of stamps."""

    begin_s: NDArray[np.float64]  # (n,)
    end_s: NDArray[np.float64]  # (n,)
    deltas: Poses  # (n, 3) pose(begin)^-1 @ pose(end)


@dataclass(frozen=True)
class RelationsScore:
    """Errors over all relations: absolute and squared, of translation (m, m²) and rotation (deg, deg²)."""

    relations: int
    missing: int
    """Relations left out because the trajectory has no pose at one of their stamps."""
    translation_m: Statistics
    translation_squared_m2: Statistics
    rotation_deg: Statistics
    rotation_squared_deg2: Statistics


def read_relations(path: Path) -> Relations:
    """Lines `t1 t2 x y z roll pitch yaw`; what is out of the plane is left out."""
    values = read_rows(path, 8, "file of relations")
    return Relations(values[:, 0], values[:, 1], values[:, [2, 3, 7]])


def relations_beside(log: Path) -> Relations | None:
    """NAME.relations beside NAME.clf.bz2; None if there is no such file."""
    path = log.with_name(f"{log.name.split('.')[0]}.relations")
    return read_relations(path) if path.exists() else None


def score_relations(laser: Trajectory, relations: Relations) -> RelationsScore:
    """The errors of the laser's trajectory; ValueError if it has none of the relations' stamps."""
    begin, begin_off_s = laser.nearest(relations.begin_s)
    end, end_off_s = laser.nearest(relations.end_s)
    found = (begin_off_s <= STAMP_TOLERANCE_S) & (end_off_s <= STAMP_TOLERANCE_S)
    if not found.any():
        raise ValueError(
            f"the trajectory from {laser.times_s[0]:.6f} to {laser.times_s[-1]:.6f} s has none of the stamps "
            f"of the relations, {relations.begin_s.min():.6f} to {relations.end_s.max():.6f} s"
        )
    error = between(relations.deltas[found], between(laser.poses[begin[found]], laser.poses[end[found]]))
    translation_m, rotation_deg = np.hypot(*error[:, :2].T), np.degrees(np.abs(error[:, 2]))
    return RelationsScore(
        relations=int(found.sum()),
        missing=int((~found).sum()),
        translation_m=Statistics.of(translation_m),
        translation_squared_m2=Statistics.of(translation_m**2),
        rotation_deg=Statistics.of(rotation_deg),
        rotation_squared_deg2=Statistics.of(rotation_deg**2),
    )
