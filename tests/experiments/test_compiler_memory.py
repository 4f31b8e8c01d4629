import mmap
import re

import pytest

from experiments.compiler_memory import LIBRARY, MAPS, code_of, let_go_of_compiler


def resident_kb(library: str) -> int:
    """How much of a library's code is in memory."""
    kb, is_code = 0, False
    for line in MAPS.with_name("smaps").read_text().splitlines():
        if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
            is_code = library in line and " r-xp " in line
        elif is_code and line.startswith("Rss:"):
            kb += int(line.split()[1])
    return kb


@pytest.mark.skipif(not MAPS.exists(), reason="only Linux tells what is mapped")
def test_the_compilers_code_leaves_memory_and_comes_back_when_it_compiles():
    from numba import njit

    assert njit(lambda x: x + 1)(1) == 2
    before_kb = resident_kb(LIBRARY)
    let_go_of_compiler()
    assert resident_kb(LIBRARY) < 0.1 * before_kb
    assert njit(lambda x: x + 2)(1) == 3


@pytest.mark.skipif(not MAPS.exists(), reason="only Linux tells what is mapped")
def test_code_is_whole_pages_of_a_library_that_is_loaded():
    import llvmlite.binding  # noqa: F401

    parts = list(code_of(LIBRARY))
    assert parts
    assert all(start < end and start % mmap.PAGESIZE == 0 for start, end in parts)
    assert not list(code_of("no such library"))
