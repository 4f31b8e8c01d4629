"""Which explorable cells stand for all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.truth import Mask

Ints = NDArray[np.int32]

PILOT_CELLS, PILOT_PLACES = 40_000, 100
"""How hard a cell is to see is found out for so many cells, by looking from so many places."""
MOST_SAMPLES = 8_000
UNIT = 64
"""Weights are whole numbers: this is the weight of a cell of the pilot that stands for itself alone."""


def samples_of(free: Mask, explorable: Mask, places: Ints, reach: float) -> tuple[Ints, NDArray[np.int64]]:
    """(s, 2) cells and (s,) the weight of each: cells that few places see are dense and light.

    A search that is shown few cells finds tours that miss what it is not shown; and what tours miss is
    hard to see. Importance sampling: a cell's chance falls with the number of places that see it, and its
    weight is the inverse of that chance.
    """
    from experiments.oracle import floor_kernels as kernels

    rng = np.random.default_rng(0)
    iy, ix = np.nonzero(explorable)
    pilot = np.sort(rng.choice(len(ix), min(PILOT_CELLS, len(ix)), replace=False))
    cells = np.column_stack((ix[pilot], iy[pilot])).astype(np.int32)
    watched = places[np.sort(rng.choice(len(places), min(PILOT_PLACES, len(places)), replace=False))]
    _, seen = kernels.looks(free, cells, watched, reach)
    chance = chances(1.0 / (1.0 + np.bincount(seen, minlength=len(cells)).astype(np.float64)), MOST_SAMPLES)
    chosen = np.flatnonzero(np.diff(np.floor(np.cumsum(chance) + rng.random()), prepend=0.0) > 0.0)
    return cells[chosen], np.rint(UNIT / chance[chosen]).astype(np.int64)


def chances(wish: NDArray[np.float64], total: int) -> NDArray[np.float64]:
    """Chances in proportion to wishes that add up to a total; none above 1."""
    chance = np.minimum(wish * total / wish.sum(), 1.0)
    for _ in range(50):
        lacking = min(total, len(wish)) - chance.sum()
        if lacking < 0.5:
            break
        is_open = chance < 1.0
        chance[is_open] = np.minimum(chance[is_open] * (1.0 + lacking / chance[is_open].sum()), 1.0)
    return chance
