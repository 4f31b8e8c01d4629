"""Long computations in slices: a robot that drives cannot wait for one that looks at all of a large map."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

T = TypeVar("T")

Sliced = Generator[int, None, T]
"""A computation that yields what each piece of it has cost, in cells that a flood takes: about 50 ns."""

TURN_CELLS = 500_000
"""A turn ends after the piece that reaches this: some 25 ms, plus that piece."""


def finish(sliced: Sliced[T]) -> T:
    """Compute all of it at once; returns what it returns."""
    while True:
        try:
            next(sliced)
        except StopIteration as end:
            return end.value


def take_turn(sliced: Sliced[object]) -> bool:
    """Compute until TURN_CELLS have been spent, the same on every machine; whether that was the end."""
    spent = 0
    for cost in sliced:
        spent += cost
        if spent >= TURN_CELLS:
            return False
    return True
