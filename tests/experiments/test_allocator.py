"""Memory of large arrays that are gone is the system's again."""

import platform
import subprocess
import sys

import pytest

LEFT_MB = """
import numpy as np
from experiments.allocator import give_back_large_blocks
if {told}: give_back_large_blocks()
def resident_mb():
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6
np.ones(3 << 20)  # of 24 MB: from here on, such blocks come from the heap
before = resident_mb()
blocks = [np.ones(1 << 19) for _ in range(10)]  # of 4 MB
last = np.ones(100)
del blocks
print(resident_mb() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="others keep no such blocks")
def test_large_blocks_go_back_to_the_system():
    assert left_mb(told=False) > 20.0
    assert left_mb(told=True) < 5.0


def left_mb(*, told: bool) -> float:
    code = LEFT_MB.format(told=told)
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return float(run.stdout)
