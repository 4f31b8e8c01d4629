"""The folder that a run leaves behind."""

from __future__ import annotations

import json
import os
import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.config_file import to_plain
from experiments.summary_parts import finite

if TYPE_CHECKING:
    from experiments.config import ExperimentConfig
    from experiments.run import Run
    from experiments.summary import Summary

CONFIG = "config.json"
SUMMARY = "summary.json"
RECORDING = "recording.rrd"
VIDEO = "exploration.mp4"
PLOT = "coverage.png"
MAPS = ("map.yaml", "map.pgm", "truth.yaml", "truth.pgm", "explorable.pgm")
TRAJECTORIES = ("trajectory.tum", "truth.tum", "laser.tum")
MARKS = (CONFIG, SUMMARY, RECORDING, VIDEO, PLOT, *MAPS, *TRAJECTORIES)
"""What a run or a replay writes. A folder that holds any of these holds a run, or an image of that name."""


class RunFolder:
    """Where a run's files go. Nothing that an earlier run wrote is overwritten."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @staticmethod
    def create(path: Path) -> RunFolder:
        """Make the folder, or use an existing one that holds no run; ValueError if it cannot be."""
        try:
            path.mkdir(parents=True, exist_ok=True)
            held = [name for name in MARKS if (path / name).exists()]
            is_writable = os.access(path, os.W_OK | os.X_OK)
        except OSError as error:
            raise ValueError(f"cannot write to --out {path}: {error.strerror}") from error
        if held:
            files = ", ".join(held)
            raise ValueError(f"--out {path} holds a run already ({files}): choose another or remove it")
        if not is_writable:
            raise ValueError(f"cannot write to --out {path}: permission denied")
        return RunFolder(path)

    @staticmethod
    def create_named(parent: Path, name: str) -> RunFolder:
        """Make `parent/name`, or `parent/name-2`, ... if that is taken; a plan may have any name."""
        name = re.sub(r"[^\w.-]+", "_", name).lstrip(".")
        try:
            parent.mkdir(parents=True, exist_ok=True)
            for number in range(1, 1_000_000):
                path = parent / (name if number == 1 else f"{name}-{number}")
                if _made(path):
                    return RunFolder(path)
        except OSError as error:
            raise ValueError(f"cannot write to {parent}: {error.strerror}; choose with --out") from error
        raise ValueError(f"{parent} is full of runs named {name}")

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def write_config(self, config: ExperimentConfig) -> None:
        """config.json: what `--config` reads to run the same again."""
        self._write_json(CONFIG, to_plain(config))

    def write_results(self, run: Run, summary: Summary) -> None:
        """Map, truth, trajectories and summary; the summary comes last, and tells that all is there."""
        from experiments.maps import write_maps

        write_maps(run.last.grid, run.experiment.scorer, self.path)
        run.trajectory.write(self / "truth.tum", self / "trajectory.tum")
        self._write_json(SUMMARY, finite(asdict(summary)))

    def _write_json(self, name: str, data: object) -> None:
        (self / name).write_text(json.dumps(data, indent=2, allow_nan=False) + "\n")


def _made(path: Path) -> bool:
    """Whether this folder is new: two runs that begin together must not share one."""
    try:
        path.mkdir()
    except FileExistsError:
        return False
    return True
