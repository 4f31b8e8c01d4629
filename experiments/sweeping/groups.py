"""Runs that belong together: same kind of building, same options. What each group amounts to, in columns.

Of a run only numbers are kept, in arrays: a million runs take some hundred megabytes.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.sweeping.jobs import CRASHED, Row

STRATEGY = "explorer.goals.strategy"
GOOD = ("complete", "sealed_in")
"""Statuses of runs that ended because nothing was left to see."""
MOST_PLANS = 10
"""More floor plans than this are not told apart in a table."""
FIGURES: dict[str, Callable[[Row], float | None]] = {
    "explored": lambda row: row["explored"],
    "wrong": lambda row: row["wrong"],
    "wall_recall": lambda row: row["wall_recall"],
    "p95_m": lambda row: row["wall_error_m"]["p95"],
    "collisions": lambda row: row["collisions"]["events"],
    "metres": lambda row: row["path_length_m"],
    "seconds": lambda row: row["sim_time_s"],
    "times_real": lambda row: row["real_time_factor"],
    "ratio": lambda row: row.get("competitive_ratio"),
}
"""What is kept of each run, nan where it has none."""


class Naming:
    """Tells runs apart by their strategy and by as many other options as that takes."""

    def __init__(self) -> None:
        self._met: set[tuple[tuple[str, str], ...]] = set()
        self._plans: set[str] = set()
        self._varying: tuple[str, ...] | None = None

    @staticmethod
    def of(rows: Iterable[Row]) -> Naming:
        """The naming that suits these rows."""
        naming = Naming()
        for row in rows:
            naming.see(row)
        return naming

    def see(self, row: Row) -> None:
        """Take one more run into account."""
        self._met.add(tuple((name, short(value)) for name, value in row.get("options", {}).items()))
        self._varying = None
        if row.get("is_plan") and len(self._plans) <= MOST_PLANS:
            self._plans.add(row["name"])

    def kind(self, row: Row) -> str:
        """The kind of building or the plan; many plans are one kind."""
        is_one_of_many = row.get("is_plan") and len(self._plans) > MOST_PLANS
        return "plans" if is_one_of_many else row.get("name", "?")

    def series(self, row: Row) -> str:
        """What distinguishes this run's group from others in the same kind of building."""
        options: Mapping[str, Any] = row.get("options", {})
        parts = [str(options[STRATEGY])] if STRATEGY in options else []
        for name in self._needed():
            if name != STRATEGY and options.get(name) is not None:
                parts.append(f"{name.rsplit('.', 1)[-1].removesuffix('_scale')} {short(options[name])}")
        return ", ".join(parts)

    def _needed(self) -> tuple[str, ...]:
        """Options that tell apart what those before them do not: what follows from others says nothing."""
        if self._varying is None:
            met = [dict(options) for options in self._met]
            needed: list[str] = []
            for name in dict.fromkeys([STRATEGY, *(name for options in met for name in options)]):
                told_apart = len({tuple(options.get(n) for n in needed) for options in met})
                if len({tuple(options.get(n) for n in [*needed, name]) for options in met}) > told_apart:
                    needed.append(name)
            self._varying = tuple(needed)
        return self._varying


def short(value: Any) -> str:
    """An option's value as people write it."""
    if isinstance(value, list):
        return " x ".join(map(short, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass
class Group:
    """The runs of one kind and series."""

    kind: str
    series: str
    runs: int = 0
    complete: int = 0
    honest: int = 0
    crashed: int = 0
    figures: dict[str, array[float]] = field(default_factory=lambda: {name: array("d") for name in FIGURES})

    def add(self, row: Row) -> None:
        """Count one run; one that crashed has no figures."""
        self.runs += 1
        if row["status"] == CRASHED:
            self.crashed += 1
            return
        self.complete += row["status"] in GOOD
        self.honest += bool(row["honest"])
        for name, figure in FIGURES.items():
            value = figure(row)
            self.figures[name].append(float("nan") if value is None else value)

    def __getitem__(self, figure: str) -> NDArray[np.float64]:
        """All values of a figure that are there."""
        values = np.array(self.figures[figure], np.float64)
        return values[np.isfinite(values)]


def group(rows: Iterable[Row], naming: Naming) -> list[Group]:
    """All groups, by kind and then by series."""
    groups: dict[tuple[str, str], Group] = {}
    for row in rows:
        place = naming.kind(row), naming.series(row)
        if place not in groups:
            groups[place] = Group(*place)
        groups[place].add(row)
    return [groups[place] for place in sorted(groups)]


def is_good(row: Row) -> bool:
    """Complete, and honestly so."""
    return row["status"] in GOOD and bool(row["honest"])


@dataclass(frozen=True)
class Column:
    """A figure of a group, as people read it."""

    title: str
    text: Callable[[Group], str]
    meaning: str
    figure: str = ""
    """Left out where no run has this figure."""


def _of(figure: str, reduce: Callable[[NDArray[np.float64]], float], form: str) -> Callable[[Group], str]:
    return lambda group: form.format(reduce(values)) if len(values := group[figure]) else "-"


def _median(figure: str, form: str) -> Callable[[Group], str]:
    return _of(figure, lambda values: float(np.median(values)), form)


COLUMNS = (
    Column("runs", lambda g: f"{g.runs}", "runs, with those that crashed"),
    Column("complete", lambda g: f"{g.complete}", "ended because nothing reachable was left to see"),
    Column("honest", lambda g: f"{g.honest}", "whose last word agrees with the truth"),
    Column("explored", _median("explored", "{:.2%}"), "of the explorable area, median"),
    Column("least", _of("explored", np.min, "{:.2%}"), "explored in the run that explored least"),
    Column("wrong", _of("wrong", np.max, "{:.3%}"), "cells believed the opposite of the truth, most"),
    Column("recall", _of("wall_recall", np.min, "{:.2%}"), "visible wall surface that was found, least"),
    Column("p95 m", _of("p95_m", np.max, "{:.3f}"), "wall error's 95th percentile in metres, most"),
    Column("hits", _of("collisions", np.sum, "{:.0f}"), "collisions, all together"),
    Column("metres", _median("metres", "{:.0f}"), "driven, median"),
    Column("seconds", _median("seconds", "{:.0f}"), "simulated, median"),
    Column("ratio", _median("ratio", "{:.3f}"), "metres driven over the oracle's, median", "ratio"),
    Column("x real", _median("times_real", "{:.0f}"), "times faster than real time, median"),
)


def columns_for(groups: Iterable[Group]) -> list[Column]:
    """Those for which there is anything to show."""
    known = list(groups)
    return [
        column for column in COLUMNS if not column.figure or any(len(group[column.figure]) for group in known)
    ]
