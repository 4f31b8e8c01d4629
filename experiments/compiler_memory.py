"""The compiler's memory: once all kernels are loaded, its code need not stay in memory."""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Iterator
from pathlib import Path

MAPS = Path("/proc/self/maps")
"""What this process has mapped where; Linux has it (proc(5))."""
LIBRARY = "libllvmlite"
"""LLVM, which compiles kernels and links those that were kept."""


def let_go_of_compiler() -> None:
    """Tell Linux that the compiler's code is not needed for now; elsewhere do nothing.

    To link the kernels takes 50 MB of it into memory, a tenth of what a large building takes in all. It is
    read from its file again where it is needed after all (madvise(2)): only code is let go of, which nobody
    writes to.
    """
    for start, end in code_of(LIBRARY):
        ctypes.CDLL(None).madvise(ctypes.c_void_p(start), ctypes.c_size_t(end - start), mmap.MADV_DONTNEED)


def code_of(library: str) -> Iterator[tuple[int, int]]:
    """From where to where the code of a shared library lies, as far as it is mapped."""
    for line in MAPS.read_text().splitlines() if MAPS.exists() else ():
        addresses, access, *_, name = line.split()
        if library in name and access == "r-xp":
            start, end = addresses.split("-")
            yield int(start, 16), int(end, 16)
