"""Buildings: bounds of solids, starts, MJCF out and in."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from occmap.geometry import Pose2
from sim.building import Box, Building, Cylinder, Door, Room
from sim.building_mjcf import load_mjcf, save_mjcf
from sim.model_files import model_path
from sim.plan_images import load_plan
from sim.starts import ALIGNED_RAD, BODY_RADIUS_M, with_start
from sim.truth import explorable, reachable, truth_grid

WALLS = (Box(2.0, 0.0, 2.0, 0.1), Box(2.0, 3.0, 2.0, 0.1), Box(0.0, 1.5, 0.1, 1.6), Box(4.0, 1.5, 0.1, 1.6))


def a_room(*furniture: Box | Cylinder) -> Building:
    return Building(
        "a room",
        "test",
        (-0.1, -0.1),
        (4.1, 3.1),
        (*WALLS, *furniture),
        Pose2(1.0 / 3.0, 0.7, 0.123456),
        (Room("the only one", (0.1, 0.1), (3.9, 2.9)),),
        (Door(Box(1.0, 3.0, 0.45, 0.02, 0.0, 1.0, "door")),),
    )


def mjcf(tmp_path: Path, body: str) -> Path:
    """An MJCF file whose world holds a closed room and what the test adds."""
    walls = "".join(
        f'<geom type="box" pos="{w.x_m} {w.y_m} .5" size="{w.half_x_m} {w.half_y_m} .5"/>' for w in WALLS
    )
    path = tmp_path / "plan.xml"
    path.write_text(f'<mujoco><worldbody><geom type="plane" size="9 9 1"/>{walls}{body}</worldbody></mujoco>')
    return path


def furniture_in(path: Path) -> tuple:
    return load_plan(path, np.random.default_rng(0)).solids[len(WALLS) :]


def test_bounds_enclose_a_turned_box():
    assert Box(1.0, 2.0, 0.5, 0.1, math.pi / 2).bounds() == pytest.approx((0.9, 1.5, 1.1, 2.5))


def test_a_building_saves_and_loads_the_same(tmp_path: Path):
    rng = np.random.default_rng(1)
    solids = [
        Box(*rng.uniform(0.5, 3, 2), *rng.uniform(0.1, 0.3, 2), round(a, 6), 0.7, "shelf") for a in (0.0, 1.2)
    ]
    building = a_room(*solids, Cylinder(*rng.uniform(0.5, 3, 2), 0.02, 0.75))
    save_mjcf(building, tmp_path / "b.xml")
    loaded, start = load_mjcf(tmp_path / "b.xml")
    assert loaded == building
    assert start == building.start


def test_a_saved_building_opens_in_mujoco_with_floor_and_light(tmp_path: Path):
    save_mjcf(a_room(), tmp_path / "b.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "b.xml"))
    assert model.nlight == 1
    assert model.geom("floor").type == mujoco.mjtGeom.mjGEOM_PLANE


def test_static_geoms_at_lidar_height_are_walls_wherever_they_are_nested(tmp_path: Path):
    path = mjcf(
        tmp_path,
        """<body pos="1 1 0" euler="0 0 90"><body pos="0.5 0 0.3">
             <geom type="box" size="0.2 0.1 0.3" euler="0 0 30"/></body></body>
           <geom type="box" pos="2 2 0.8" size="0.5 0.5 0.05"/>
           <geom type="box" pos="3 2 0.05" size="0.3 0.3 0.05"/>
           <body pos="3 1 1"><freejoint/><geom type="box" size="0.2 0.2 0.9"/></body>""",
    )
    (box,) = furniture_in(path)  # the table's top, the doorstep and the loose crate are no walls
    assert (box.x_m, box.y_m, box.height_m) == pytest.approx((1.0, 1.5, 0.6))
    assert math.degrees(box.yaw_rad) == pytest.approx(120.0)


def test_round_things_come_as_cylinders_and_tilted_ones_as_the_box_around_them(tmp_path: Path):
    path = mjcf(
        tmp_path,
        """<geom type="cylinder" pos="1 1 0.5" size="0.2 0.5"/>
           <geom type="capsule" pos="2 1 0.5" size="0.1 0.3"/>
           <geom type="sphere" pos="3 1 0.3" size="0.25"/>
           <geom type="capsule" pos="2 2 0.2" size="0.1 0.4" zaxis="1 0 0"/>""",
    )
    pole, pillar, ball, log = furniture_in(path)
    assert (pole.radius_m, pillar.radius_m, ball.radius_m) == (0.2, 0.1, 0.25)
    assert pole == Cylinder(1.0, 1.0, 0.2, 1.0, "wall")
    assert log.bounds() == pytest.approx((1.5, 1.9, 2.5, 2.1))


def test_a_mesh_at_lidar_height_is_refused(tmp_path: Path):
    path = mjcf(tmp_path, '<geom name="statue" type="mesh" mesh="m" pos="1 1 0.2"/>')
    asset = '<asset><mesh name="m" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset><worldbody>'
    path.write_text(path.read_text().replace("<worldbody>", asset, 1))
    with pytest.raises(ValueError, match=r"'statue' is a mesh at the lidar's height"):
        load_mjcf(path)


def test_floors_and_ceilings_are_no_walls_and_a_tilted_plane_is_refused(tmp_path: Path):
    ceiling = '<geom type="plane" pos="0 0 2.5" euler="{} 0 0" size="9 9 1"/>'
    assert furniture_in(mjcf(tmp_path, ceiling.format(180) + ceiling.format(0))) == ()
    with pytest.raises(ValueError, match=r"'ramp' is a plane that is not level at the lidar's height"):
        load_mjcf(mjcf(tmp_path, '<geom name="ramp" type="plane" pos="2 2 0" euler="20 0 0" size="1 1 1"/>'))


@pytest.mark.parametrize("name", ["bounds", "room:kitchen"])
def test_bounds_of_anything_but_four_numbers_are_a_mistake(tmp_path: Path, name: str):
    path = mjcf(tmp_path, "")
    custom = f'<custom><numeric name="{name}" data="0 0 4"/></custom><worldbody>'
    path.write_text(path.read_text().replace("<worldbody>", custom, 1))
    with pytest.raises(ValueError, match=rf"plan\.xml: the numeric {name} must be x0 y0 x1 y1"):
        load_mjcf(path)


def test_the_site_named_start_is_the_start(tmp_path: Path):
    path = mjcf(tmp_path, '<body pos="1 1 0"><site name="start" pos="0.5 0 0" euler="0 0 40"/></body>')
    start = load_plan(path, np.random.default_rng(0)).start
    assert (start.x_m, start.y_m, math.degrees(start.yaw_rad)) == pytest.approx((1.5, 1.0, 40.0))


def test_without_one_the_rng_chooses_a_clear_place_askew_to_the_walls(tmp_path: Path):
    path = mjcf(tmp_path, "")
    starts = [load_plan(path, np.random.default_rng(seed)).start for seed in range(20)]
    assert len({start.position for start in starts}) > 10
    for start in starts:
        assert 0.1 + 0.22 < start.x_m < 3.9 - 0.22
        assert abs(math.sin(2.0 * start.yaw_rad)) >= math.sin(2.0 * ALIGNED_RAD) - 1e-9


def test_a_plan_that_one_could_walk_out_of_is_fenced_in(tmp_path: Path):
    path = tmp_path / "open.xml"
    boxes = '<geom type="box" pos="0 0 .5" size="2 .1 .5"/><geom type="box" pos="0 3 .5" size="2 .1 .5"/>'
    path.write_text(
        f'<mujoco><worldbody>{boxes}<site name="start" pos="0 1.5 0" euler="0 0 20"/></worldbody></mujoco>'
    )
    building = load_plan(path, np.random.default_rng(0))
    seen = explorable(truth_grid(building, 0.05), building.start, BODY_RADIUS_M, 12.0)
    assert len(building.solids) == 6
    assert not seen[[0, -1], :].any()
    assert not seen[:, [0, -1]].any()


@pytest.mark.parametrize("name", ["flat", "loop_office"])
def test_in_the_plans_made_by_hand_the_start_reaches_all_rooms(name: str):
    building = load_plan(model_path(f"plans/{name}.xml"), np.random.default_rng(0))
    truth = truth_grid(building, 0.05)
    reached = reachable(truth, building.start, BODY_RADIUS_M)
    assert len(building.rooms) >= 5
    assert len(building.doors) >= 4
    for room in building.rooms:
        (x0, y0), (x1, y1) = truth.cell_from_world(np.array([room.low_m, room.high_m]))
        assert reached[y0:y1, x0:x1].mean() > 0.3, room.name


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (Pose2(9.0, 1.0, 0.0), "outside of the building"),
        (Pose2(2.0, 0.05, 0.0), "inside a wall"),
        (Pose2(1.5, 1.5, 0.0), "inside a wall"),
        (Pose2(2.0, 0.2, 0.0), r"0\.10 m from a solid"),
    ],
)
def test_a_start_where_the_body_does_not_fit_is_refused(pose: Pose2, message: str):
    with pytest.raises(ValueError, match=message):
        with_start(a_room(Cylinder(1.5, 1.5, 0.1)), pose)


@pytest.mark.parametrize(
    "text", ["<mujoco><worldbody/></mujoco>", "<mujoco><worldbody>", "# a shopping list"]
)
def test_a_file_that_is_no_plan_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "plan.xml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"plan\.xml is not"):
        load_plan(path, np.random.default_rng(0))
