"""The C library's memory: what large arrays leave goes back to the system."""

from __future__ import annotations

import ctypes
import platform

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of malloc.h
LARGE_BYTES = 1 << 20
"""A block of this size is asked of the system, and given back to it."""
SPARE_BYTES = 1 << 23
"""So much is kept for smaller ones."""


def give_back_large_blocks() -> None:
    """Tell glibc to keep no large blocks to itself; elsewhere do nothing.

    Left alone it takes every large block that is freed for a hint to keep such blocks, of up to 32 MB, and
    twice as much at the end of its heap: an hour into a large building tens of megabytes lie idle. Told a
    size, it learns no more (mallopt(3)).
    """
    if platform.libc_ver()[0] == "glibc":
        library = ctypes.CDLL(None)
        library.mallopt(M_MMAP_THRESHOLD, LARGE_BYTES)
        library.mallopt(M_TRIM_THRESHOLD, SPARE_BYTES)
