"""Large arrays of which little is written to: the rest costs neither time nor memory."""

from __future__ import annotations

import contextlib
import math
import mmap
from collections.abc import Iterator

import numpy as np
from numpy.typing import DTypeLike, NDArray

LARGE_BYTES = 1 << 22
"""Smaller arrays are not worth the effort."""
BLOCK = (64, 2048)
"""Rows and columns that are looked at together."""
HUGE_PAGES = getattr(mmap, "MADV_HUGEPAGE", None)
"""Linux alone has it."""


def lazy_zeros(shape: tuple[int, int], dtype: DTypeLike) -> NDArray:
    """Zeros (ny, nx) that cost nothing until they are written to, and then little.

    In huge pages, where the system has them: those that np.zeros gets take four times as long to be written
    to for the first time.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size < LARGE_BYTES or HUGE_PAGES is None:
        return np.zeros(shape, dtype)
    memory = mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with contextlib.suppress(OSError):  # a kernel built without them refuses
        memory.madvise(HUGE_PAGES)
    return np.frombuffer(memory, dtype).reshape(shape)


def filled(shape: tuple[int, int], value: np.generic | float, dtype: DTypeLike) -> NDArray:
    """An array (ny, nx) of one value; where it is 0, lazily, and else in huge pages as well."""
    out = lazy_zeros(shape, dtype)
    if value != 0:
        out[...] = value
    return out


def copy_written(source: NDArray, target: NDArray, *, is_blank: bool = False) -> None:
    """target[...] = source, (ny, nx) both, passing over blocks that hold nothing but zeros in either.

    is_blank: the target is known to hold nothing else.
    """
    if source.nbytes < LARGE_BYTES:
        target[...] = source
        return
    for block in blocks(source.shape):
        if source[block].any() or (not is_blank and target[block].any()):
            target[block] = source[block]


def fill_written(target: NDArray, value: np.generic | int) -> None:
    """target[...] = value, (ny, nx); if that is 0, passing over blocks that hold nothing else."""
    for block in blocks(target.shape):
        if value != 0 or target[block].any():
            target[block] = value


def blocks(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Rows and columns of the blocks that make up an array (ny, nx)."""
    rows, columns = BLOCK
    for y in range(0, shape[0], rows):
        for x in range(0, shape[1], columns):
            yield slice(y, y + rows), slice(x, x + columns)
