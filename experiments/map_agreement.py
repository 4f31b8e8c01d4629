"""How far the walls of one map lie from those of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from occmap.grid import Belief
from occmap.map_server import NavMap
from sim.truth import grown


@dataclass(frozen=True)
class MapAgreement:
    """Of the occupied cells of a map whose place a reference knows, free or occupied."""

    occupied: int
    """Occupied cells of the map, whether the reference knows the place or not."""
    seen: int
    """Of those, the ones whose place the reference knows."""
    share: float | None
    """Of the seen, those in or beside (8 neighbours) an occupied cell of the reference; None of none."""
    mean_m: float | None
    """Mean distance from the seen to the nearest occupied cell of the reference, between cell centres."""
    p95_m: float | None
    """The 95th percentile of those distances."""


def map_agreement(judged: NavMap, reference: NavMap) -> MapAgreement:
    """How well the walls of `judged` lie on those of `reference`, both placed by their own origins.

    Cells may differ in size and be turned: the centre of each occupied cell is looked up in the reference.
    """
    iy, ix = np.nonzero(judged.state == Belief.OCCUPIED)
    centres = judged.resolution_m * (np.column_stack((ix, iy)).astype(np.float64) + 0.5)
    in_reference = (reference.origin.inverse() @ judged.origin).apply(centres)
    cells = np.floor(in_reference / reference.resolution_m).astype(np.int64)
    height, width = reference.state.shape
    inside = ((cells >= 0) & (cells < (width, height))).all(axis=1)
    at = cells[inside, 1], cells[inside, 0]
    known = reference.state[at] != Belief.UNKNOWN
    at = at[0][known], at[1][known]
    wall = reference.state == Belief.OCCUPIED
    if not (at[0].size and wall.any()):
        return MapAgreement(len(ix), at[0].size, 0.0 if at[0].size else None, None, None)
    off_m = reference.resolution_m * _distance_to(wall)[at]
    share = float(grown(wall)[at].mean())
    return MapAgreement(len(ix), at[0].size, share, float(off_m.mean()), float(np.percentile(off_m, 95)))


def _distance_to(wall: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(ny, nx) distance from each cell to the nearest of the wall, in cells."""
    return np.asarray(distance_transform_edt(~wall), np.float64)
