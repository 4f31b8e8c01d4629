"""Configs whose every number must be positive."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any


class Positive:
    """A base for config dataclasses: lengths, spreads, counts and shares of zero or less make no sense."""

    def __post_init__(self) -> None:
        values: Any = self
        for each in fields(values):
            value = getattr(self, each.name)
            if isinstance(value, int | float) and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{type(self).__name__}.{each.name} must be positive, got {value}")
