"""One line of a benchmark's table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """What was measured, beside what it should be."""

    name: str
    value: float | None
    """None where this machine lacks what it takes, such as a C compiler."""
    unit: str
    aim: str = ""

    def __str__(self) -> str:
        value = "-" if self.value is None else f"{self.value:.3g}"
        return f"{self.name:<48}{value:>10}  {self.unit:<24}{self.aim}"
