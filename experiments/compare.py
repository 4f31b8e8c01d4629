"""A gate: is sweep B worse than sweep A?

    python -m experiments.compare runs/main runs/branch
    python -m experiments.compare runs/s runs/s --where-a strategy=nearest --where-b strategy=utility

Pairs the runs by building and seed and says with a confidence interval which explores more and drives
less. See docs/sweeps.md for its use in continuous integration.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from experiments.comparison import Comparison, Tolerance, compare
from experiments.exit_status import MISTAKE
from experiments.pairing import Pairing, pair
from experiments.sweeping.groups import short
from experiments.sweeping.jobs import Row
from experiments.sweeping.runs import Runs

WORSE = 1
"""Exit status if B is."""
FEW = 10
"""With fewer buildings a bootstrap is too sure of itself."""


@dataclass(frozen=True)
class Compare:
    """Say whether the runs of B are better than those of A, building by building.

    Exit status: 0 B is not worse, 1 it is, 2 a mistake. B is worse if the whole 95 % interval of its metres
    or of what it explored lies on the wrong side, or if it fails more often.
    """

    a: tyro.conf.Positional[Path]
    """A sweep's folder, in however many parts it was run, or a results.jsonl: what was."""
    b: tyro.conf.Positional[Path]
    """Another: what is."""
    where_a: tuple[str, ...] = ()
    """NAME=VALUE: of A only the runs with this option, or of this kind. NAME is strategy, noise_scale, name,
    or any other that the sweep varied."""
    where_b: tuple[str, ...] = ()
    """The same of B."""
    each_kind: bool = False
    """B must not be worse in any kind of building, rather than all together."""
    seed: int = 0
    """Of the resampling behind the intervals."""
    tolerance: Tolerance = field(default_factory=Tolerance)

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")


def selected(rows: Iterable[Row], where: Sequence[str]) -> Iterator[Row]:
    """Those that have all the options asked for; ValueError if no run knows one of them."""
    wanted = [_condition(text) for text in where]
    known: set[str] = set()
    for row in rows:
        facts = facts_of(row)
        known |= set(facts)
        if all(facts.get(name) == value for name, value in wanted):
            yield row
    for name, _ in wanted:
        if name not in known:
            raise ValueError(f"no run has an option {name!r}; there are {', '.join(sorted(known))}")


def facts_of(row: Row) -> dict[str, str]:
    """What a run can be chosen by: its options by their full and by their last name, kind and seed."""
    facts = {"name": str(row.get("name")), "seed": str(row.get("seed"))}
    for name, value in row.get("options", {}).items():
        facts[name] = facts[name.rsplit(".", 1)[-1]] = short(value)
    return facts


def _condition(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"where needs NAME=VALUE, got {text!r}")
    return name, value


COLUMNS = (
    ("pairs", 6, lambda c: f"{c.pairs}"),
    ("metres A", 10, lambda c: f"{c.metres_a:.0f}"),
    ("metres B", 10, lambda c: f"{c.metres_b:.0f}"),
    ("metres, B / A", 24, lambda c: "-" if c.metres is None else f"{c.metres:.3f}"),
    ("explored, B - A in %", 28, lambda c: f"{c.explored.percent:+.3f}"),
    ("lost", 6, lambda c: f"{c.lost}"),
    ("won", 6, lambda c: f"{c.won}"),
)
"""(title, width, what is in it)."""


def table(found: Sequence[Comparison]) -> str:
    """A line per kind of building."""
    name = max(len(c.kind) for c in found) + 2
    lines = [" " * name + "".join(f"{title:>{width}}" for title, width, _ in COLUMNS)]
    for c in found:
        lines.append(f"{c.kind:<{name}}" + "".join(f"{text(c):>{width}}" for _, width, text in COLUMNS))
    return "\n".join(lines)


def verdict(found: Sequence[Comparison], asked: Compare) -> tuple[str, bool]:
    """(what to say, whether B is worse)."""
    judged = found if asked.each_kind else found[-1:]
    complaints = [(c.kind, text) for c in judged for text in asked.tolerance.complaints(c)]
    if complaints:
        return "\n".join(f"B is worse ({kind}): {text}" for kind, text in complaints), True
    overall = found[-1]
    if overall.metres is not None and overall.metres.high < 1.0:
        return f"B is better: it drives {1.0 - overall.metres.value:.1%} less", False
    if overall.explored.low > 0.0:
        return f"B is better: it explores {overall.explored.percent.value:.3f} points more", False
    return "B is not shown to be worse, nor better", False


def reservations(pairing: Pairing) -> list[str]:
    """What was left out, and what makes the intervals doubtful."""
    said = []
    if pairing.only_a or pairing.only_b:
        said.append(f"left out: {pairing.only_a} runs that only A has, {pairing.only_b} that only B has")
    if pairing.differing:
        said.append(f"left out: {pairing.differing} pairs whose seed made another building in B than in A")
    buildings = len({a.place for a, _ in pairing.pairs})
    if buildings < FEW:
        said.append(f"only {buildings} buildings: so few make the intervals too narrow")
    return said


def nothing_pairs(pairing: Pairing) -> str:
    """Why there is nothing to compare."""
    if pairing.differing:
        return f"nothing to compare: all {pairing.differing} seeds made another building in B than in A"
    varied = f"; they vary in {', '.join(pairing.told_apart_by)}" if pairing.told_apart_by else ""
    return (
        f"nothing to compare: of {pairing.only_a} runs of A and {pairing.only_b} of B none are of the same "
        f"building and seed{varied}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, pair, compare, print. Returns the exit status."""
    asked = tyro.cli(Compare, prog="python -m experiments.compare", args=arguments)
    try:
        a = selected(Runs([asked.a], all_parts=True), asked.where_a)
        b = selected(Runs([asked.b], all_parts=True), asked.where_b)
        pairing = pair(a, b)
        if not pairing.pairs:
            raise ValueError(nothing_pairs(pairing))
        found = compare(pairing, asked.seed)
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    said, is_worse = verdict(found, asked)
    print("\n".join([table(found), *reservations(pairing), said]))
    return WORSE if is_worse else 0


if __name__ == "__main__":
    sys.exit(main())
