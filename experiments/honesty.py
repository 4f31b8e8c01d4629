"""Whether a run tells the truth about itself.

A status claims something. `time_limit`, `stuck`, `physics_fault` and `interrupted` claim only that
the run ended early, which is so by itself. `complete` and `sealed_in` claim that nothing reachable
is left to see. That is judged by what was left out: the clusters (8 neighbours) of unexplored
explorable cells larger than HIDDEN_M2, the area of the robot's own footprint. The claim is honest if
each of them lies entirely where no part of the robot's body could come from the start, and beside a frontier
that the certificate of being done lists as `too_narrow` or `sealed`: a slot that one could have
peered through at a steeper angle.

Whatever the status, no frontier given up or called unsafe may hide explorable area: no cluster of
more than SPECK_CELLS cells may lie beside one. A cluster is beside a frontier if it comes within
BESIDE_M of the frontier's ends.

For `sealed_in` all of this is about the world as it stands at the end, with its doors closed and
from where the robot is; and it is honest only if a door has closed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator

import numpy as np

from experiments.outcome import Outcome
from occmap.decision import Reason, UnknownLeft
from occmap.geometry import Points, Pose2
from sim.starts import BODY_RADIUS_M
from sim.truth import Mask, TruthGrid, connected_parts

HIDDEN_M2 = math.pi * BODY_RADIUS_M**2
"""What the robot itself would stand on."""
SPECK_CELLS = 4
BESIDE_M = 0.25
"""The spacing of the places that the explorable area is seen from."""


def is_honest(
    outcome: Outcome,
    unexplored: Mask,
    unknown_left: Collection[UnknownLeft],
    truth: TruthGrid,
    world_from_map: Pose2,
    in_reach: Callable[[], Mask],
) -> bool:
    """See the top of this file.

    `unexplored` are the explorable cells that the map has not got; `in_reach`, asked only if it
    matters, says on which cells some part of the body could stand.
    """

    def listed_as(*reasons: Reason) -> list[UnknownLeft]:
        return [left for left in unknown_left if left.reason in reasons]

    def is_beside(cluster: Points, frontiers: list[UnknownLeft]) -> bool:
        return any(distance_m(cluster, f, world_from_map) <= BESIDE_M for f in frontiers)

    given_up = listed_as(Reason.GAVE_UP, Reason.UNSAFE)
    if any(is_beside(truth.world_from_cell(c), given_up) for c in clusters(unexplored, SPECK_CELLS)):
        return False
    if outcome not in (Outcome.COMPLETE, Outcome.SEALED_IN):
        return True
    hidden = list(clusters(unexplored, HIDDEN_M2 / truth.resolution_m**2))
    closed = listed_as(Reason.TOO_NARROW, Reason.SEALED)
    if not all(is_beside(truth.world_from_cell(cells), closed) for cells in hidden):
        return False
    return not hidden or not any(in_reach()[cells[:, 1], cells[:, 0]].any() for cells in hidden)


def clusters(mask: Mask, more_than: float) -> Iterator[np.ndarray]:
    """(n, 2) cells (ix, iy) of each connected part of more than so many cells."""
    parts = connected_parts(mask)
    sizes = np.bincount(parts.ravel())
    for part in np.flatnonzero(sizes > more_than):
        if part:  # 0 is what is not in the mask
            iy, ix = np.nonzero(parts == part)
            yield np.column_stack((ix, iy))


def distance_m(cluster: Points, frontier: UnknownLeft, world_from_map: Pose2) -> float:
    """From the ends of a frontier, however it is turned, to the nearest cell of a cluster in `world`."""
    centre = world_from_map.apply(np.array([frontier.in_map]))
    return float(np.hypot(*(cluster - centre).T).min()) - 0.5 * frontier.size_m
