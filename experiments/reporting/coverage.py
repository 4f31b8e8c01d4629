"""Coverage curves of many runs as one: the median and the quartiles of what was explored by then."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from experiments.sweeping.groups import Naming
from experiments.sweeping.jobs import Row

Over = Literal["metres", "seconds"]
MOST_CURVES = 1000
"""Of each group so many are drawn: its first seeds, and one seed is as good as another."""
STEPS = 300
"""Places at which the curves are read."""


@dataclass
class Bundle:
    """The curves of one kind and series."""

    kind: str
    series: str
    curves: list[dict[str, NDArray[np.float32]]] = field(default_factory=list)
    """Each with metres, seconds and explored, all rising."""

    def reach(self, over: Over) -> float:
        """By then 19 of 20 runs are over."""
        return float(np.percentile([curve[over][-1] for curve in self.curves], 95))

    def end(self, over: Over) -> float:
        """When the median run was over."""
        return float(np.median([curve[over][-1] for curve in self.curves]))

    def quartiles(self, over: Over, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, n) first quartile, median and third quartile of the explored share at each place.

        A run that is over keeps what it had explored.
        """
        explored = np.array([np.interp(at, curve[over], curve["explored"]) for curve in self.curves])
        return np.percentile(explored, (25, 50, 75), axis=0)


def bundles(rows: Iterable[Row], naming: Naming) -> dict[str, list[Bundle]]:
    """All curves by kind, in it by series; runs without one are left out."""
    found: dict[tuple[str, str], Bundle] = {}
    for row in rows:
        curve = row.get("curve")
        if not curve or not curve["explored"]:
            continue
        place = naming.kind(row), naming.series(row)
        bundle = found.setdefault(place, Bundle(*place))
        if len(bundle.curves) < MOST_CURVES:
            bundle.curves.append({name: np.array(values, np.float32) for name, values in curve.items()})
    by_kind: dict[str, list[Bundle]] = {}
    for (kind, _), bundle in sorted(found.items()):
        by_kind.setdefault(kind, []).append(bundle)
    return by_kind
