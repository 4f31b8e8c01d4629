"""A boundary on the truth's grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from occmap.boundary import are_within, polygon
from sim.truth import Mask, TruthGrid


def cells_within(boundary: Sequence[tuple[float, float]], truth: TruthGrid) -> Mask | None:
    """(ny, nx) cells whose centre lies within a polygon in `world`; None if there is no boundary."""
    if not boundary:
        return None
    iy, ix = np.indices(truth.wall.shape).reshape(2, -1)
    centres = truth.world_from_cell(np.column_stack((ix, iy)))
    return are_within(polygon(boundary), centres).reshape(truth.wall.shape)
