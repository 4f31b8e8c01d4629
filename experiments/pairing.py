"""Which runs of two sweeps belong together: same building, same seed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.sweeping.groups import GOOD, is_good
from experiments.sweeping.jobs import CRASHED, Row

FACTS = ("size_m", "rooms", "doors", "obstacles")
"""What can be counted in a building, at whatever resolution."""


@dataclass(frozen=True)
class Run:
    """What a comparison needs to know of a run."""

    kind: str
    is_plan: bool
    building_id: str
    seed: int
    options: Mapping[str, str]
    facts: tuple[Any, ...] = ()
    """FACTS of its building; none if it crashed."""
    is_complete: bool = False
    is_good: bool = False
    """Complete and honest, and nothing was touched."""
    explored: float = 0.0
    metres: float = 0.0

    @staticmethod
    def of(row: Row) -> Run:
        """Of a row of results. A run that crashed has explored nothing."""
        name = row.get("name", "?")
        options = {option: str(value) for option, value in row.get("options", {}).items()}
        about = name, bool(row.get("is_plan")), row.get("building_id", name), row["seed"], options
        if row["status"] == CRASHED:
            return Run(*about)
        return Run(
            *about,
            facts=tuple(row.get("building", {}).get(fact) for fact in FACTS),
            is_complete=row["status"] in GOOD,
            is_good=is_good(row) and not row["collisions"]["events"],
            explored=row["explored"],
            metres=row["path_length_m"],
        )

    @property
    def place(self) -> tuple[str, int]:
        """The building and what happened by chance in it: runs that share both are not independent."""
        return self.building_id, self.seed

    def is_where(self, other: Run) -> bool:
        """Whether both were in the same building: other generators may make another one of the same seed."""
        return not self.facts or not other.facts or self.facts == other.facts


@dataclass(frozen=True)
class Pairing:
    """The runs of A and B that belong together, and how many were left out."""

    pairs: list[tuple[Run, Run]]
    only_a: int = 0
    only_b: int = 0
    """Runs without a partner."""
    differing: int = 0
    """Pairs whose seed made two different buildings."""
    told_apart_by: tuple[str, ...] = ()
    """Options that vary within A or B, so that partners must agree on them."""


def pair(a: Iterable[Row], b: Iterable[Row]) -> Pairing:
    """Pair by building, seed and all options that vary within A or within B.

    ValueError if a run could be paired in two ways. What is the same all through A and all through B, like
    the strategy of each, need not agree: that is what is compared.
    """
    runs_a, runs_b = list(map(Run.of, a)), list(map(Run.of, b))
    options = tuple(dict.fromkeys([*_varying(runs_a), *_varying(runs_b)]))
    by_key_a, by_key_b = _by_key(runs_a, options, "A"), _by_key(runs_b, options, "B")
    common = [(by_key_a[key], by_key_b[key]) for key in by_key_a if key in by_key_b]
    pairs = [(a, b) for a, b in common if a.is_where(b)]
    only_a, only_b = len(by_key_a) - len(common), len(by_key_b) - len(common)
    return Pairing(pairs, only_a, only_b, len(common) - len(pairs), options)


def _varying(runs: Sequence[Run]) -> list[str]:
    values: dict[str, set[str]] = {}
    for run in runs:
        for name, value in run.options.items():
            values.setdefault(name, set()).add(value)
    return [name for name, found in values.items() if len(found) > 1]


def _by_key(runs: Sequence[Run], options: Sequence[str], side: str) -> dict[tuple[str, ...], Run]:
    found: dict[tuple[str, ...], Run] = {}
    for run in runs:
        key = (run.building_id, str(run.seed), *(run.options.get(name, "") for name in options))
        if key in found:
            raise ValueError(f"{side} has two runs of seed {run.seed} in the building {run.building_id}")
        found[key] = run
    return found
