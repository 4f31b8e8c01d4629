"""Whether a run tells the truth about itself.

A status claims something. `time_limit`, `stuck` and `interrupted` claim only that the run ended
early, which is so by itself. `complete` and `sealed_in` claim that nothing reachable is left to
see: that is honest unless unexplored explorable cells hang together (8 neighbours) over more than
HIDDEN_M2, the area of the robot's own footprint. Whatever the status, no frontier given up or called
unsafe may hide explorable area: none such cluster of more than SPECK_CELLS cells may come within
BESIDE_M of the frontier's ends.

For `sealed_in` the explorable area is the one of the world as it stands at the end, with its doors
closed and from where the robot is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from experiments.outcome import Outcome
from occmap.decision import Reason, UnknownLeft
from occmap.geometry import Points, Pose2
from sim.truth import Mask, TruthGrid, connected_parts

HIDDEN_M2 = math.pi * 0.17**2
"""What the robot itself would stand on."""
SPECK_CELLS = 4
BESIDE_M = 0.25
"""A frontier and what it hides are at most this far apart: the spacing of the places to look from."""


def is_honest(
    outcome: Outcome,
    unexplored: Mask,
    unknown_left: Iterable[UnknownLeft],
    truth: TruthGrid,
    world_from_map: Pose2,
) -> bool:
    """See the top of this file. `unexplored` are the explorable cells that the map has not got."""
    clusters = Clusters(unexplored, truth)
    claims_all = outcome in (Outcome.COMPLETE, Outcome.SEALED_IN)
    if claims_all and clusters.largest_m2 > HIDDEN_M2:
        return False
    given_up = [left for left in unknown_left if left.reason in (Reason.GAVE_UP, Reason.UNSAFE)]
    return not any(clusters.come_near(left, world_from_map) for left in given_up)


class Clusters:
    """What is left unexplored, by connected cluster."""

    def __init__(self, unexplored: Mask, truth: TruthGrid) -> None:
        self._truth = truth
        parts = connected_parts(unexplored)
        self._sizes = np.bincount(parts.ravel())[1:]
        iy, ix = np.nonzero(parts)
        sizeable = self._sizes[parts[iy, ix] - 1] > SPECK_CELLS
        self._in_world: Points = truth.world_from_cell(np.column_stack((ix, iy))[sizeable])

    @property
    def largest_m2(self) -> float:
        """The area of the largest cluster."""
        return float(self._sizes.max(initial=0)) * self._truth.resolution_m**2

    def come_near(self, left: UnknownLeft, world_from_map: Pose2) -> bool:
        """Whether a cluster of more than SPECK_CELLS cells lies beside a frontier."""
        centre: NDArray[np.float64] = world_from_map.apply(np.array([left.in_map]))
        distance_m = np.hypot(*(self._in_world - centre).T)
        return bool(distance_m.min(initial=math.inf) <= 0.5 * left.size_m + BESIDE_M)
