"""After the warm-up a robot waits for no kernel, and its explorer is as new."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import state_file
from occmap.warm_up import Room
from tests.occmap.localization.drives import RING, RING_LAP, drive, mapped, observe


@pytest.fixture(scope="module")
def state(tmp_path_factory):
    """A map to be localised in."""
    path = tmp_path_factory.mktemp("map") / "ring.slam"
    state_file.save(path, mapped(observe(RING, drive(RING_LAP), np.random.default_rng(0))))
    return path


@pytest.mark.parametrize("kind", ["odometry", "slam", "map", "large cones"])
def test_after_the_warm_up_no_kernel_is_loaded_and_the_explorer_is_as_new(kind, state):
    """In a process of its own: other tests load kernels, too."""
    program = [sys.executable, "-m", "tests.occmap.late_kernels", kind, str(state)]
    done = subprocess.run(program, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == {"late": [], "is_untouched": True}


def test_beams_of_the_made_up_room_end_on_its_walls():
    scan = Room(2.0).scan(Pose2(-2.0, 1.0, 0.5))
    x, y = Pose2(-2.0, 1.0, 0.5).apply(scan.hits_in_lidar()).T
    outer = np.isclose(abs(x), 6.0) | np.isclose(abs(y), 4.0)
    inner = (x > 0.8 - 1e-9) & (x < 1.2 + 1e-9) & (y > -1e-9)
    assert scan.is_hit.all()
    assert (outer | inner).all()
    assert (inner & ~outer).any()
