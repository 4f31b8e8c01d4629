"""Pictures of the world, where graphics are to be had."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from occmap.geometry import Pose2
from sim.building import Box, Door
from sim.render import BACKENDS, open_studio
from sim.scene import building_scene
from tests.sim.rooms import room

START = Pose2(1.0, 1.0, 0.0)
BUILDING = room(6.0, 4.0, START, doors=(Door(Box(4.0, 2.0, 0.05, 0.45)),))
SIZE_PX = (150, 100)


@pytest.fixture(scope="module")
def studio():
    model = building_scene(BUILDING, BUILDING.doors).compile()
    opened = open_studio(model, BUILDING, SIZE_PX)
    if opened is None:
        pytest.skip("no graphics on this machine")
    with opened:
        yield opened


def changed_near(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Metres in the room, from its lower left corner, of the middle of what differs between two overviews."""
    rows, columns = np.nonzero(np.abs(before.astype(int) - after).sum(axis=2) > 60)
    px_per_m = SIZE_PX[1] / (1.06 * 4.0)
    return 3.0 + (columns.mean() - SIZE_PX[0] / 2) / px_per_m, 2.0 - (rows.mean() - SIZE_PX[1] / 2) / px_per_m


def test_pictures_are_as_large_as_asked_for_and_show_something(studio):
    picture = studio.overview(START)
    assert picture.shape == (100, 150, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 10


def test_north_is_up_and_east_is_right(studio):
    away = studio.overview(Pose2(-50.0, 0.0, 0.0))
    there = studio.overview(Pose2(4.5, 3.0, 0.0))
    assert changed_near(away, there) == pytest.approx((4.5, 3.0), abs=0.3)


def test_a_closing_door_comes_out_of_the_floor(studio):
    opened, closed = studio.overview(START, [0.0]), studio.overview(START, [1.0])
    assert changed_near(opened, closed) == pytest.approx((4.0, 2.0), abs=0.5)


def test_a_building_of_more_things_than_mujoco_draws_by_default_is_drawn(studio):
    specks = (Box(0.05 + 0.05 * (k % 110), 0.05 + 0.03 * (k // 110), 0.01, 0.01) for k in range(10_050))
    ragged = room(6.0, 4.0, START, tuple(specks))
    model = building_scene(ragged).compile()
    assert model.ngeom > 10_000
    opened = open_studio(model, ragged, SIZE_PX)
    assert opened is not None
    with opened:
        assert opened.overview(START).std() > 10


def test_no_graphics_is_a_value_and_not_an_error(monkeypatch):
    monkeypatch.setattr("sim.render.BACKENDS", ("nonsense",))
    assert open_studio(building_scene(BUILDING).compile(), BUILDING, SIZE_PX) is None


def test_this_process_never_asks_for_graphics(studio):
    assert "OpenGL" not in sys.modules
    assert BACKENDS == ("egl", "osmesa")
