"""Who may know whom, and what importing costs."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
OUTER_ROOMS = {"sim", "experiments", "tests"}
HEAVY = {"numba", "mujoco", "rerun", "matplotlib", "imageio", "llvmlite"}


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imports(file: Path) -> Iterator[str]:
    """Every module that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{file}: imports name their package"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room(module: str) -> str:
    return module.split(".")[0]


@pytest.mark.parametrize("file", sources("occmap"), ids=lambda file: file.name)
def test_the_mind_knows_neither_the_world_nor_how_it_is_watched(file):
    strangers = OUTER_ROOMS | {"mujoco", "rerun", "matplotlib", "imageio", "tyro", "tqdm"}
    assert strangers.isdisjoint(room(module) for module in imports(file))


@pytest.mark.parametrize("file", sources("sim"), ids=lambda file: file.name)
def test_the_world_knows_only_the_vocabulary_of_the_mind(file):
    known = {module for module in imports(file) if room(module) == "occmap"}
    assert all(module.startswith(("occmap.geometry", "occmap.scan")) for module in known)
    assert {"experiments", "rerun", "matplotlib", "numba.cuda"}.isdisjoint(room(m) for m in imports(file))


def loaded_by(statement: str) -> set[str]:
    """Top-level packages in memory after a statement in a fresh interpreter."""
    code = f"{statement}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(out.stdout.split())


@pytest.mark.parametrize(
    "statement",
    [
        "import occmap",
        "import sim",
        "import experiments",
        "from experiments.command import Command",
    ],
)
def test_importing_is_light_until_there_is_work(statement):
    assert loaded_by(statement).isdisjoint(HEAVY)


def test_the_explorer_itself_loads_no_kernels_before_it_is_made():
    assert "numba" not in loaded_by("import occmap.explorer")


def test_nothing_committed_depends_on_the_machine_it_was_made_on():
    elsewhere = ["/work" + "/shared", ".." + "/shared", ".libr" + "ary", "/op" + "t/venv", "pypi" + ".org"]
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    for name in listed.stdout.splitlines():
        file = ROOT / name
        if not file.is_file() or b"\0" in (content := file.read_bytes())[:8000]:
            continue
        found = [place for place in elsewhere if place in content.decode(errors="replace")]
        assert not found, f"{name} names {found}"
