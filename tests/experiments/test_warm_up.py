"""After the warm-up nothing is compiled or loaded while the robot drives."""

import gc
import json
import subprocess
import sys
from pathlib import Path

import pytest

from experiments import warm_up
from experiments.config import ExperimentConfig
from occmap.rehearsal import compile_aside, garbage_left_alone, settle_a_graph
from tests.experiments.loaded_kernels import kernels

NOT_NEEDED = {
    "occmap.mapper_kernels.integrate_cones",  # an option: beams that are cones
    "occmap.localization.surfel_kernels.linearise",  # called by a kernel; its namesake is not
}


@pytest.fixture(scope="module")
def warm():
    warm_up.warm_up(ExperimentConfig(pose="slam"))


def test_the_warm_up_loads_every_kernel_that_a_run_may_need_and_in_one_shape():
    """In a process of its own: other tests load kernels, too."""
    program = [sys.executable, "-m", "tests.experiments.loaded_kernels"]
    done = subprocess.run(program, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True)
    loaded = json.loads(done.stdout.splitlines()[-1])
    assert len(loaded) > 40
    assert {name: n for name, n in loaded.items() if n != 1 and name not in NOT_NEEDED} == {}


def test_what_the_warm_up_has_made_is_never_looked_through_for_garbage():
    before, usual = gc.get_freeze_count(), gc.get_threshold()
    with garbage_left_alone():
        made = [[] for _ in range(1000)]
    assert gc.get_freeze_count() >= before + len(made)
    assert gc.get_threshold() == usual


def test_the_other_half_is_compiled_aside_on_a_first_run_only(warm, monkeypatch):
    assert not any(warm_up.is_first_run(pose) for pose in ("truth", "slam", "odometry"))

    def never(*_, **__):
        raise AssertionError("no other process is needed")

    monkeypatch.setattr(warm_up.subprocess, "Popen", never)
    with warm_up.compiling_aside("slam"):
        pass
    monkeypatch.setattr(warm_up, "is_first_run", lambda pose: True)
    monkeypatch.setattr(warm_up.os, "cpu_count", lambda: 1)
    with warm_up.compiling_aside("slam"):
        pass


@pytest.mark.parametrize("other", ["raise SystemExit(1)", "import time; time.sleep(100)"])
def test_another_process_that_fails_or_hangs_when_interrupted_is_no_matter(monkeypatch, other):
    monkeypatch.setattr(warm_up, "is_first_run", lambda pose: True)
    monkeypatch.setattr(warm_up.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(warm_up, "OTHER_HALF", other)
    if "sleep" in other:
        with pytest.raises(KeyboardInterrupt), warm_up.compiling_aside("slam"):
            raise KeyboardInterrupt
    else:
        with warm_up.compiling_aside("slam"):
            pass


def test_what_is_compiled_aside_is_what_the_drive_will_need(warm):
    """In the same shapes: others would be compiled for nothing."""
    shapes = {name: kernel.signatures for name, kernel in kernels()}
    settle_a_graph()
    compile_aside("slam")
    gc.enable()
    assert {name: kernel.signatures for name, kernel in kernels()} == shapes
