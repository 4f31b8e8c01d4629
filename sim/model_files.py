"""Finds the MJCF files, installed or in the source tree."""

from __future__ import annotations

from importlib import resources
from pathlib import Path


def model_path(name: str) -> Path:
    """The path of `models/<name>`: beside this package in a wheel, at the top of a checkout."""
    installed = Path(str(resources.files("sim"))) / "models" / name
    checkout = Path(__file__).resolve().parent.parent / "models" / name
    for path in (installed, checkout):
        if path.is_file():
            return path
    raise ValueError(f"no model file {name!r}: looked for {installed} and {checkout}")
