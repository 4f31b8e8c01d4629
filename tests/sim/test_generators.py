"""Generated buildings: fair, furnished, reproducible."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from scipy import ndimage

from sim.building import Box, Building, Cylinder
from sim.generators import LEAST_SIZE_M, BuildingConfig, generate
from sim.generators.furniture import footprint_m2
from sim.generators.spaces import Space, doorway, mouth, shared_wall, walls_of
from sim.starts import ALIGNED_RAD, BODY_RADIUS_M, with_start
from sim.truth import LIDAR_HEIGHT_M, explorable, reachable, truth_grid

KINDS = ("office", "apartment", "maze", "hall")
SEEDS = range(6)

each_building = pytest.mark.parametrize(("kind", "seed"), [(kind, seed) for kind in KINDS for seed in SEEDS])
each_furnished = pytest.mark.parametrize(
    ("kind", "seed"), [(kind, seed) for kind in KINDS if kind != "maze" for seed in SEEDS]
)


@cache
def built(kind: str, seed: int) -> Building:
    return generate(BuildingConfig(kind), np.random.default_rng(seed))


def cover(building: Building, low: tuple[float, float], high: tuple[float, float]) -> float:
    """The share of a rectangle that furniture stands on."""
    area = (high[0] - low[0]) * (high[1] - low[1])
    furniture = [s for s in building.solids if s.kind != "wall"]
    inside = [s for s in furniture if low[0] <= s.x_m <= high[0] and low[1] <= s.y_m <= high[1]]
    return sum(footprint_m2(s) for s in inside) / area


def thin_legs(building: Building) -> list[Cylinder]:
    return [s for s in building.solids if isinstance(s, Cylinder) and s.radius_m == 0.02]


def digest(building: Building) -> str:
    return hashlib.sha256(repr(building).encode()).hexdigest()


@each_building
def test_the_start_reaches_all_rooms(kind: str, seed: int):
    building = built(kind, seed)
    truth = truth_grid(building, 0.05)
    reached = reachable(truth, building.start, BODY_RADIUS_M)
    for room in building.rooms:
        (x0, y0), (x1, y1) = truth.cell_from_world(np.array([room.low_m, room.high_m]))
        assert reached[y0:y1, x0:x1].mean() > 0.25, room.name


@each_building
def test_the_walls_enclose_the_building(kind: str, seed: int):
    building = built(kind, seed)
    seen = explorable(truth_grid(building, 0.05), building.start, BODY_RADIUS_M, 12.0)
    assert not seen[[0, 1, -2, -1], :].any()
    assert not seen[:, [0, 1, -2, -1]].any()
    assert seen.sum() * 0.05**2 > 60.0


@each_building
def test_the_body_fits_at_the_start_and_no_wall_is_aligned_with_it(kind: str, seed: int):
    building = built(kind, seed)
    assert with_start(building, building.start) == building
    assert abs(math.sin(2.0 * building.start.yaw_rad)) >= math.sin(2.0 * ALIGNED_RAD) - 1e-5


@each_building
def test_whatever_can_be_touched_can_be_seen(kind: str, seed: int):
    assert all(solid.height_m > LIDAR_HEIGHT_M + 0.1 for solid in built(kind, seed).solids)


@each_furnished
def test_furniture_in_every_room_covers_a_fair_share_of_the_floor(kind: str, seed: int):
    building = built(kind, seed)
    assert 0.05 <= cover(building, building.low_m, building.high_m) <= 0.15
    for room in building.rooms:
        assert 0.05 <= cover(building, room.low_m, room.high_m) <= 0.15, room.name
    assert len(thin_legs(building)) >= 4


def test_an_office_drawn_without_a_table_is_drawn_again():
    assert len(thin_legs(built("office", 217))) >= 4


@each_furnished
def test_doors_are_wide_and_nothing_stands_in_them(kind: str, seed: int):
    building = built(kind, seed)
    assert building.doors
    for door in building.doors:
        panel = door.panel
        assert 2.0 * max(panel.half_x_m, panel.half_y_m) == pytest.approx(0.9)
        along_x = panel.half_x_m > panel.half_y_m
        for off_m in (-0.5, 0.0, 0.5):
            x, y = (panel.x_m, panel.y_m + off_m) if along_x else (panel.x_m + off_m, panel.y_m)
            nearest = min(_distance(solid, x, y) for solid in building.solids)
            assert nearest > 0.4, (x, y)


def _distance(solid: Box | Cylinder, x: float, y: float) -> float:
    x0, y0, x1, y1 = solid.bounds()
    return math.hypot(max(x0 - x, x - x1, 0.0), max(y0 - y, y - y1, 0.0))


@pytest.mark.parametrize("seed", SEEDS)
def test_an_office_has_ten_rooms_and_a_loop(seed: int):
    building = built("office", seed)
    assert len(building.rooms) >= 10
    reached = reachable(truth_grid(building, 0.05), building.start, BODY_RADIUS_M)
    around, islands = ndimage.label(~reached)
    sizes = np.bincount(around.ravel())[1:] * 0.05**2
    assert islands >= 2
    assert (sizes > 4.0).sum() >= 2  # the outside, and a block of rooms that one can drive around


def test_default_sizes():
    sizes = {kind: built(kind, 0).high_m for kind in KINDS}
    assert sizes["office"] == sizes["hall"] == (30.0, 20.0)
    assert sizes["maze"] == (20.0, 20.0)
    assert sizes["apartment"][0] * sizes["apartment"][1] >= 80.0


@pytest.mark.parametrize(
    ("kind", "size_m"),
    [(kind, size) for kind in KINDS for size in (LEAST_SIZE_M[kind], LEAST_SIZE_M[kind][::-1], (17.3, 24.9))]
    + [("office", (12.0, 10.0)), ("office", (60.0, 45.0)), ("hall", (70.0, 40.0))],
)
def test_other_sizes(kind: str, size_m: tuple[float, float]):
    building = generate(BuildingConfig(kind, size_m=size_m), np.random.default_rng(0))
    assert building.high_m == size_m
    bounds = np.array([solid.bounds() for solid in building.solids])
    assert (bounds[:, :2].min(axis=0) >= -1e-6).all()
    assert (bounds[:, 2:].max(axis=0) <= np.array(size_m) + 1e-6).all()


@pytest.mark.parametrize("kind", KINDS)
def test_the_seed_alone_decides(kind: str):
    again = generate(BuildingConfig(kind), np.random.default_rng(0))
    assert again == built(kind, 0)
    assert built(kind, 1) != built(kind, 0)


def test_another_process_builds_the_same():
    code = (
        "import hashlib, numpy as np; from sim.generators import BuildingConfig, generate\n"
        "for kind in ('office', 'apartment', 'maze', 'hall'):\n"
        "    building = generate(BuildingConfig(kind), np.random.default_rng(0))\n"
        "    print(hashlib.sha256(repr(building).encode()).hexdigest())"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == [digest(built(kind, 0)) for kind in KINDS]


def test_a_wall_is_interrupted_by_its_doorway_and_by_nothing_else():
    west, east = Space("office", 0.0, 0.0, 3.0, 4.0), Space("office", 3.0, 1.0, 6.0, 4.0)
    wall = shared_wall(west, east)
    assert wall is not None
    assert (wall.is_along_x, wall.at, wall.low, wall.high) == (False, 3.0, 1.0, 4.0)
    opening = doorway(west, east, np.random.default_rng(0))
    assert opening is not None
    parts = [b for b in walls_of([west, east], [opening]) if b.x_m == 3.0 and b.half_x_m == 0.075]
    length = sum(2.0 * b.half_y_m for b in parts)
    assert len(parts) == 2
    assert length == pytest.approx(4.0 + 0.15 - 0.9)


def test_spaces_that_only_meet_at_a_corner_share_no_wall():
    a, b = Space("office", 0.0, 0.0, 3.0, 3.0), Space("office", 3.0, 3.0, 6.0, 6.0)
    assert shared_wall(a, b) is None
    assert mouth(a, b) is None
    assert doorway(a, b, np.random.default_rng(0)) is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "castle"}, "unknown kind of building 'castle': choose from office, apartment, maze, hall"),
        ({"seed": -1}, "must not be negative, got -1"),
        ({"size_m": (3.0, 3.0)}, "needs at least"),
        ({"size_m": (math.nan, 20.0)}, "at most 300"),
        ({"size_m": (1e6, 20.0)}, "at most 300"),
        ({"size_m": (-30.0, 20.0)}, "needs at least"),
    ],
)
def test_mistakes_are_named(options: dict, message: str):
    with pytest.raises(ValueError, match=message):
        BuildingConfig(**options)
