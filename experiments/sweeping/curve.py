"""A run's coverage curve, short enough to be kept for each of a million runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from experiments.curves import Sample

POINTS = 100
"""At most so many are kept of a curve: finer than a plot shows."""


def curve_of(samples: Sequence[Sample]) -> dict[str, list[float]]:
    """`seconds`, `metres`, `explored` at instants spread evenly over the run, first and last among them."""
    chosen = np.unique(np.linspace(0, len(samples) - 1, min(POINTS, len(samples))).round().astype(int))
    kept = [samples[index] for index in chosen]
    return {
        "seconds": [round(sample.time_s, 1) for sample in kept],
        "metres": [round(sample.path_length_m, 2) for sample in kept],
        "explored": [round(sample.score.explored, 5) for sample in kept],
    }
