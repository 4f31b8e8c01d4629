"""Lookouts: a few places that together see into all frontiers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.coarse_map import CoarseMap
from occmap.frontiers import Frontier

SEEN_SHARE = 0.5
"""A look at less of a frontier only moves its end on a little."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A frontier to be looked into, and how."""

    frontier: Frontier
    targets: NDArray[np.int64]
    """(k, 5) unknown cells beyond it that sample it: see goals_kernels.TARGET_COLUMNS."""
    reach_cells: int
    """From no farther than this."""


@dataclass(frozen=True)
class Lookout:
    """Where to stand, and what is seen from there that no lookout before it sees."""

    block: int
    members: tuple[int, ...]
    """Indices of the sights, the largest frontier first."""
    is_exact: bool
    """Whether these are seen from there; else it is merely the block nearest to a frontier."""


def lookouts(coarse: CoarseMap, sights: Sequence[Sight], from_start_m: NDArray[np.float64]) -> list[Lookout]:
    """Places that the body gets to, greedily chosen: each sees the most of what none so far does.

    A frontier that no block sees into is stood for by the nearest in sight of it, if there is any.
    from_start_m (ny, nx): what the way to each block costs; of equal places the cheapest is taken. A greedy
    cover is at most ln(n) times the least one (Chvátal, A greedy heuristic for the set-covering problem,
    1979). For viewpoints: González-Baños and Latombe, A randomized art-gallery algorithm for sensor
    placement, SoCG 2001.
    """
    from occmap import tour_kernels as kernels

    sizes = np.array([sight.frontier.size for sight in sights], float)
    pairs = kernels.watchers(
        coarse.fine.state, coarse.fine.clearance_m, coarse.side, from_start_m,
        np.concatenate([sight.targets for sight in sights]),
        np.cumsum([len(sight.targets) for sight in sights]),
        np.array([sight.reach_cells for sight in sights]), SEEN_SHARE,
    )  # fmt: skip
    blocks, rows = np.unique(pairs[:, 0], return_inverse=True)
    by_cost = np.argsort(from_start_m.ravel()[blocks], kind="stable")
    blocks, rows, seen = blocks[by_cost], np.argsort(by_cost)[rows], pairs[:, 1]
    found: list[Lookout] = []
    left = np.ones(len(sights), bool)
    while len(seen):
        best = int(np.argmax(np.bincount(rows, sizes[seen])))
        members = seen[rows == best]
        members = members[np.argsort(-sizes[members], kind="stable")]
        found.append(Lookout(int(blocks[best]), tuple(members.tolist()), is_exact=True))
        left[members] = False
        still = left[seen]
        rows, seen = rows[still], seen[still]
    for k in np.flatnonzero(left).tolist():
        block = coarse.block_of(sights[k].frontier)
        if block is not None and np.isfinite(from_start_m.ravel()[block]):
            found.append(Lookout(block, (k,), is_exact=False))
    return found
