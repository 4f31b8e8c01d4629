"""One line of a benchmark's table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """What was measured, beside what it should be."""

    name: str
    value: float | None
    """None where this machine lacks what it takes, such as a C compiler."""
    unit: str
    aim: str = ""
    missing: str = "-"
    """What stands there for a value that is None."""

    def __str__(self) -> str:
        value = self.missing if self.value is None else f"{self.value:.3g}"
        return f"{self.name:<48}{value:>14}  {self.unit:<24}{self.aim}"


def ratio(ours: float, theirs: float | None) -> float | None:
    """None if there is nothing to compare with."""
    return None if theirs is None else ours / theirs


def compared(ours_ms: float, rivals_ms: Mapping[str, float | None]) -> Iterator[Figure]:
    """How many times longer others take for it."""
    for name, theirs_ms in rivals_ms.items():
        times = None if theirs_ms is None else theirs_ms / ours_ms
        yield Figure(f"  {name}", times, "x ours", missing="not installed")
