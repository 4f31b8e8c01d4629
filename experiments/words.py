"""What commands say to people, and how they say numbers."""

from __future__ import annotations

import sys


def say(text: str) -> None:
    """To people: standard output is left to tables, for other programs."""
    print(text, file=sys.stderr, flush=True)


def counted(n: int, noun: str) -> str:
    """1 frontier, 2 frontiers."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"
