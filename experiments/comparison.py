"""Is B better than A? Runs in the same building with the same seed, paired.

Buildings differ far more from each other than explorers do, so only differences within pairs count, and
the uncertainty is that of having met these buildings and not others: a bootstrap over buildings (Efron and
Tibshirani, An Introduction to the Bootstrap, 1993, chapter 13: percentile intervals). Pairs that met the same
building, with other noise say, count together as one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.pairing import Pairing, Run
from experiments.sweeping.groups import MOST_PLANS

RESAMPLES = 10_000
CONFIDENCE = 0.95


ROUNDING = 1e-9
"""What is worse by as much as is tolerated, to the last digit, is tolerated."""


@dataclass(frozen=True)
class Interval:
    """An estimate, and where it might as well be."""

    value: float
    low: float
    high: float

    @property
    def percent(self) -> Interval:
        """The same, of a share, in per cent."""
        return Interval(100.0 * self.value, 100.0 * self.low, 100.0 * self.high)

    def __format__(self, form: str) -> str:
        return f"{self.value:{form}} [{self.low:{form}}, {self.high:{form}}]"


@dataclass(frozen=True)
class Comparison:
    """B against A in one kind of building, or in all."""

    kind: str
    pairs: int
    metres: Interval | None
    """B's metres over A's, the geometric mean over buildings, of pairs that both completed; None without."""
    metres_a: float
    metres_b: float
    """All metres of those pairs."""
    explored: Interval
    """B's explored share less A's, the mean over all buildings."""
    lost: int
    """Pairs of which A was complete, honest and without collision and B was not."""
    won: int
    """The other way round."""


@dataclass(frozen=True)
class Tolerance:
    """What does not yet make B worse."""

    metres: float = 0.0
    """B may drive this share more: 0.02 is 2 %."""
    explored: float = 0.0
    """B may explore this share less: 0.001 is 0.1 %."""
    failures: int = 0
    """B may have so many failures more."""

    def __post_init__(self) -> None:
        for name in ("metres", "explored", "failures"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"the tolerance for {name} must not be negative, got {getattr(self, name)}")

    def complaints(self, found: Comparison) -> list[str]:
        """In what B is worse, beyond doubt and beyond this tolerance."""
        said = []
        if found.metres is not None and found.metres.low > 1.0 + self.metres + ROUNDING:
            said.append(f"it drives {found.metres.value - 1.0:.1%} more")
        if found.explored.high < -self.explored - ROUNDING:
            said.append(f"it explores {-found.explored.percent.value:.3f} points less")
        if found.lost - found.won > self.failures:
            said.append(
                f"it fails where A did not {found.lost} times, and the other way round {found.won} times"
            )
        return said


def compare(pairing: Pairing, seed: int = 0) -> list[Comparison]:
    """Each kind of building, and where there are several all together at the end. Many plans are one kind."""
    are_many = len({a.kind for a, _ in pairing.pairs if a.is_plan}) > MOST_PLANS
    by_kind: dict[str, list[tuple[Run, Run]]] = {}
    for a, b in pairing.pairs:
        by_kind.setdefault("plans" if a.is_plan and are_many else a.kind, []).append((a, b))
    found = [_compared(kind, pairs, seed) for kind, pairs in sorted(by_kind.items())]
    return [*found, _compared("all", pairing.pairs, seed)] if len(found) > 1 else found


def _compared(kind: str, pairs: Sequence[tuple[Run, Run]], seed: int) -> Comparison:
    both = [(a, b) for a, b in pairs if a.is_complete and b.is_complete and a.metres > 0.0 < b.metres]
    metres = None
    if both:
        metres = bootstrap(by_place(both, lambda a, b: math.log(b.metres / a.metres)), seed, math.exp)
    explored = by_place(pairs, lambda a, b: b.explored - a.explored)
    return Comparison(
        kind=kind,
        pairs=len(pairs),
        metres=metres,
        metres_a=sum(a.metres for a, _ in both),
        metres_b=sum(b.metres for _, b in both),
        explored=bootstrap(explored, seed),
        lost=sum(a.is_good and not b.is_good for a, b in pairs),
        won=sum(b.is_good and not a.is_good for a, b in pairs),
    )


def by_place(pairs: Sequence[tuple[Run, Run]], figure: Callable[[Run, Run], float]) -> NDArray[np.float64]:
    """(n,) the mean of a figure over the pairs of each building and seed."""
    found: dict[tuple[str, int], list[float]] = {}
    for a, b in pairs:
        found.setdefault(a.place, []).append(figure(a, b))
    return np.array([math.fsum(figures) / len(figures) for figures in found.values()])


def bootstrap(
    values: NDArray[np.float64], seed: int, shown: Callable[[float], float] = lambda value: value
) -> Interval:
    """The mean and the percentile interval of its bootstrap: O(RESAMPLES * n), some megabytes at a time."""
    rng, n = np.random.default_rng(seed), len(values)
    at_a_time = max(1, 500_000 // n)
    means = [
        values[rng.integers(0, n, (min(at_a_time, RESAMPLES - begun), n))].mean(axis=1)
        for begun in range(0, RESAMPLES, at_a_time)
    ]
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(np.concatenate(means), (tail, 100.0 - tail))
    return Interval(float(shown(values.mean())), float(shown(low)), float(shown(high)))
