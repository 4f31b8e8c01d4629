"""Which code made a result: a fingerprint of everything that can change one.

A version number says what its author remembered to say, and a commit says nothing of edits that were
not committed. So the sources themselves are hashed: those that a run imports, found by following import
statements, the robot's models, and the versions of the packages that compute. An edit of a report, a
test or a recorder leaves every result as it is.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import sys
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OURS = ("occmap", "sim", "experiments")
COMPUTING = ("mujoco", "numpy", "scipy", "numba", "qdldl")
"""Packages whose version may change a result."""


@functools.cache
def code_version() -> str:
    """16 hex digits that change with whatever may change a result."""
    from sim.model_files import model_path

    sha = hashlib.sha256()
    for name, file in sorted(sources("experiments.sweeping.jobs").items()):
        sha.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
    for file in sorted(model_path("scene.xml").parent.glob("*.xml")):
        sha.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    python = f"python {sys.version_info.major}.{sys.version_info.minor}"
    for package in COMPUTING:
        sha.update(f"{package} {metadata.version(package)}\0".encode())
    sha.update(python.encode())
    return sha.hexdigest()[:16]


def sources(module: str) -> dict[str, Path]:
    """The file of a module and of every module of ours that it imports, at whatever depth."""
    found: dict[str, Path] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        file = _file(name)
        if file is None or name in found:
            continue
        found[name] = file
        waiting += _ours(_imported(file))
    return found


def _file(module: str) -> Path | None:
    """Where a module of ours lives; None for a name that is no module."""
    stem = ROOT.joinpath(*module.split("."))
    return next((file for file in (stem.with_suffix(".py"), stem / "__init__.py") if file.is_file()), None)


def _imported(file: Path) -> Iterator[str]:
    """Every name that a file imports, wherever in it; what it imports from a package may be a module."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _ours(modules: Iterable[str]) -> Iterator[str]:
    """Those of our packages, each with the packages that hold it: they run first."""
    for module in modules:
        parts = module.split(".")
        if parts[0] in OURS:
            yield from (".".join(parts[:end]) for end in range(1, len(parts) + 1))
