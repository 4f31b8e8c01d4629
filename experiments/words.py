"""Numbers as people say them."""

from __future__ import annotations


def counted(n: int, noun: str) -> str:
    """1 frontier, 2 frontiers."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"
