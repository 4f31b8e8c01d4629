"""One seed, many independent sources of chance."""

from __future__ import annotations

import zlib

import numpy as np


class Streams:
    """Named random streams, all grown from one seed.

    A stream depends on the seed and on its own name alone: adding a source, or drawing more from
    one, leaves every other as it was. `child` hands a whole family of names to a part of the world
    that has several sources of its own.
    """

    def __init__(self, seed: int, _path: tuple[int, ...] = ()) -> None:
        if seed < 0:
            raise ValueError(f"seed must not be negative, got {seed}")
        self.seed = seed
        self._path = _path

    def _sequence(self, name: str) -> np.random.SeedSequence:
        return np.random.SeedSequence(self.seed, spawn_key=(*self._path, _key(name)))

    def child(self, name: str) -> Streams:
        """The family of streams called `name/...`."""
        return Streams(self.seed, (*self._path, _key(name)))

    def generator(self, name: str) -> np.random.Generator:
        """A generator at the beginning of the named stream."""
        return np.random.Generator(np.random.PCG64(self._sequence(name)))

    def integer(self, name: str) -> int:
        """One non-negative 31-bit number: a seed that people can type."""
        return int(self._sequence(name).generate_state(1)[0] >> 1)


def _key(name: str) -> int:
    """A name as 32 bits, the same in every process (unlike `hash`)."""
    return zlib.crc32(name.encode())
