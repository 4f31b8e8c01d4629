"""Where a robot cannot go, it says so, and is done with what it can reach."""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from experiments.config import ExperimentConfig
from experiments.experiment import prepare
from experiments.run import run
from experiments.summary import Summary, summarise

ROOM_M2 = 12.0


def two_rooms(folder: Path, gap_cells: int) -> Path:
    """Two rooms of 3 m x 4 m side by side, at 5 cm a pixel, with a gap in the wall between them."""
    plan = np.zeros((84, 126), np.uint8)
    plan[2:82, 2:62] = plan[2:82, 64:124] = 255
    plan[40 : 40 + gap_cells, 62:64] = 255
    file = folder / "rooms.png"
    imageio.imwrite(file, plan)
    return file


def explored_from_the_left(plan: Path) -> Summary:
    start = (1.5, 2.0, 0.4)
    config = ExperimentConfig(seed=2, pose="truth", plan=plan, plan_resolution_m=0.05, start=start)
    return summarise(run(prepare(config)))


def test_a_closed_room_is_all_there_is(tmp_path):
    summary = explored_from_the_left(two_rooms(tmp_path, gap_cells=0))
    assert summary.status == "complete"
    assert summary.honest
    assert summary.explorable_area_m2 == pytest.approx(ROOM_M2, abs=0.1)
    assert summary.explored > 0.99


def test_a_slot_that_the_body_does_not_fit_through_is_listed_as_too_narrow(tmp_path):
    summary = explored_from_the_left(two_rooms(tmp_path, gap_cells=5))
    assert summary.status == "complete"
    assert summary.honest
    narrow = [left for left in summary.unknown_left if left["reason"] == "too_narrow"]
    assert narrow
    assert all(2.9 < left["x_m"] < 6.3 and 0.0 < left["y_m"] < 4.2 for left in narrow)
    assert summary.explored > 0.9  # the rest is in sight only at angles steeper than it was looked in at


def test_a_door_that_the_body_fits_through_is_gone_through(tmp_path):
    summary = explored_from_the_left(two_rooms(tmp_path, gap_cells=10))
    assert summary.status == "complete"
    assert summary.explorable_area_m2 > 1.95 * ROOM_M2
    assert summary.explored > 0.99
