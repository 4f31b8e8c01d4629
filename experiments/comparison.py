"""Is B better than A? Runs in the same building with the same seed, paired.

Buildings differ far more from each other than explorers do, so only differences within pairs count, and
the uncertainty is that of having met these buildings and not others: a bootstrap over pairs (Efron and
Tibshirani, An Introduction to the Bootstrap, 1993, chapter 13: percentile intervals).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from experiments.sweeping.groups import GOOD, MOST_PLANS, is_good
from experiments.sweeping.jobs import CRASHED, Row

RESAMPLES = 10_000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Outcome:
    """What a comparison needs to know of a run."""

    kind: str
    is_plan: bool
    is_complete: bool
    is_good: bool
    """Complete and honest, and nothing was touched."""
    explored: float
    """0 if it crashed."""
    metres: float

    @staticmethod
    def of(row: Row) -> Outcome:
        """Of a row of results."""
        kind, is_plan = row.get("name", "?"), bool(row.get("is_plan"))
        if row["status"] == CRASHED:
            return Outcome(kind, is_plan, False, False, 0.0, 0.0)
        clean = is_good(row) and not row["collisions"]["events"]
        is_complete = row["status"] in GOOD
        return Outcome(kind, is_plan, is_complete, clean, row["explored"], row["path_length_m"])


@dataclass(frozen=True)
class Pairing:
    """The runs of A and B that belong together, and how many have no partner."""

    pairs: list[tuple[Outcome, Outcome]]
    only_a: int = 0
    only_b: int = 0
    told_apart_by: tuple[str, ...] = ()
    """Options that vary within A or B, so that partners must agree on them."""


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
    """B's metres over A's, the geometric mean over pairs that both completed; None if there is none."""
    metres_a: float
    metres_b: float
    """All metres of those pairs."""
    explored: Interval
    """B's explored share less A's, the mean over all pairs."""
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
        if found.metres is not None and found.metres.low > 1.0 + self.metres:
            said.append(f"it drives {found.metres.value - 1.0:.1%} more")
        if found.explored.high < -self.explored:
            said.append(f"it explores {-found.explored.percent.value:.3f} points less")
        if found.lost - found.won > self.failures:
            said.append(
                f"it fails where A did not {found.lost} times, and the other way round {found.won} times"
            )
        return said


def pair(a: Iterable[Row], b: Iterable[Row]) -> Pairing:
    """Pair by building, seed and all options that vary within A or within B.

    ValueError if a run could be paired in two ways. What is the same all through A and all through B, like
    the strategy of each, need not agree: that is what is compared.
    """
    rows_a, rows_b = list(map(_known, a)), list(map(_known, b))
    options = tuple(dict.fromkeys([*_varying(rows_a), *_varying(rows_b)]))
    by_key_a, by_key_b = _by_key(rows_a, options, "A"), _by_key(rows_b, options, "B")
    common = [key for key in by_key_a if key in by_key_b]
    pairs = [(by_key_a[key], by_key_b[key]) for key in common]
    return Pairing(pairs, len(by_key_a) - len(common), len(by_key_b) - len(common), options)


@dataclass(frozen=True)
class _Known:
    """A run, without its curve: all that is kept of it."""

    building: str
    seed: int
    options: Mapping[str, str] = field(hash=False)
    outcome: Outcome


def _known(row: Row) -> _Known:
    options = {name: str(value) for name, value in row.get("options", {}).items()}
    building = row.get("building_id", row.get("name", "?"))
    return _Known(building, row["seed"], options, Outcome.of(row))


def _varying(rows: Sequence[_Known]) -> list[str]:
    values: dict[str, set[str]] = {}
    for row in rows:
        for name, value in row.options.items():
            values.setdefault(name, set()).add(value)
    return [name for name, found in values.items() if len(found) > 1]


def _by_key(rows: Sequence[_Known], options: Sequence[str], side: str) -> dict[tuple[str, ...], Outcome]:
    found: dict[tuple[str, ...], Outcome] = {}
    for row in rows:
        key = (row.building, str(row.seed), *(row.options.get(name, "") for name in options))
        if key in found:
            raise ValueError(f"{side} has two runs of seed {row.seed} in the building {row.building}")
        found[key] = row.outcome
    return found


def compare(pairing: Pairing, seed: int = 0) -> list[Comparison]:
    """Each kind of building, and where there are several all together at the end. Many plans are one kind."""
    are_many = len({a.kind for a, _ in pairing.pairs if a.is_plan}) > MOST_PLANS
    by_kind: dict[str, list[tuple[Outcome, Outcome]]] = {}
    for a, b in pairing.pairs:
        by_kind.setdefault("plans" if a.is_plan and are_many else a.kind, []).append((a, b))
    found = [_compared(kind, pairs, seed) for kind, pairs in sorted(by_kind.items())]
    return [*found, _compared("all", pairing.pairs, seed)] if len(found) > 1 else found


def _compared(kind: str, pairs: Sequence[tuple[Outcome, Outcome]], seed: int) -> Comparison:
    both = [(a, b) for a, b in pairs if a.is_complete and b.is_complete and a.metres > 0.0 < b.metres]
    metres = None
    if both:
        logs = np.log([b.metres / a.metres for a, b in both])
        metres = bootstrap(logs, seed, np.exp)
    explored = np.array([b.explored - a.explored for a, b in pairs])
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
