"""Bases for config dataclasses: numbers that make no sense are refused by name."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any


class Positive:
    """Every number must be positive: lengths, spreads, counts and shares of zero or less make no sense."""

    def __post_init__(self) -> None:
        for name, value in _numbers(self):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{type(self).__name__}.{name} must be positive, got {value}")


class NeverNegative:
    """Every number must be zero or more: margins, waiting times and shares that may be done without."""

    def __post_init__(self) -> None:
        for name, value in _numbers(self):
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{type(self).__name__}.{name} must not be negative, got {value}")


def _numbers(config: Any) -> list[tuple[str, float]]:
    values = [(each.name, getattr(config, each.name)) for each in fields(config)]
    return [(name, value) for name, value in values if isinstance(value, int | float)]
