"""What the summaries of runs and of replays have in common."""

from __future__ import annotations

import hashlib
import math
import platform
import resource
import struct
from importlib import metadata
from pathlib import Path
from typing import Any

from occmap.grid import OccupancyGrid


def peak_memory_mb() -> float:
    """The most that this whole process has had in memory since it began.

    Linux counts what a parent had as its child's, too (getrusage), but for the figure in /proc.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1024**2 if platform.system() == "Darwin" else peak / 1024


def map_sha256(grid: OccupancyGrid) -> str:
    """The fingerprint of a belief: where its lattice lies, and free, occupied or unknown of each cell."""
    geometry = struct.pack("<d4q", grid.config.resolution_m, *grid.offset, *grid.shape)
    return hashlib.sha256(geometry + grid.state.tobytes()).hexdigest()


def versions() -> dict[str, str]:
    """What produced the figures, and the recordings."""
    packages = ("occmap", "mujoco", "numpy", "scipy", "numba", "qdldl", "rerun-sdk")
    return {"python": platform.python_version()} | {name: metadata.version(name) for name in packages}


def finite(value: Any) -> Any:
    """Plain data in which what is not a finite number has become None: JSON knows no nan."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
