"""Physics that survives abuse, counts what touches, and never fails in silence."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from occmap.geometry import Pose2, Twist2
from sim.building import Box, Cylinder, Door
from sim.collisions import Collisions
from sim.faults import FaultsConfig, PhysicsFault
from sim.model_files import model_path
from sim.scene import building_scene
from sim.solids import SolidArrays
from sim.starts import BODY_RADIUS_M
from sim.truth import LIDAR_HEIGHT_M
from sim.world import World
from tests.sim.rooms import robot_in, room

CLUTTER = (Cylinder(1.0, 3.0, 0.02), Cylinder(3.2, 1.1, 0.15), Box(2.8, 2.9, 0.4, 0.2, 0.7, kind="furniture"))
DOOR = Door(Box(2.0, 1.0, 0.05, 0.9))


@pytest.mark.parametrize("name", ["robot.xml", "scene.xml"])
def test_every_model_survives_one_shaken_second(name):
    model = mujoco.MjModel.from_xml_path(str(model_path(name)))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    for _ in range(round(1.0 / model.opt.timestep)):
        data.ctrl[:] = rng.uniform(-14.0, 14.0, model.nu)
        mujoco.mj_step(model, data)
    assert not data.warning.number.any()


def test_a_missing_model_is_named():
    with pytest.raises(ValueError, match=r"nothing\.xml"):
        model_path("nothing.xml")


def test_the_chassis_encloses_all_of_the_robot_that_is_low_enough_to_touch_a_wall():
    model = World(room(4.0, 4.0, Pose2(2.0, 2.0, 0.0))).model
    radius = model.geom("chassis").size[0]
    assert radius == BODY_RADIUS_M
    track, wheel = model.body("left_wheel").pos[1], model.geom("left_wheel").size
    assert math.hypot(track + wheel[1], wheel[0]) < radius
    for name in ("front_caster", "rear_caster"):
        assert abs(model.geom(name).pos[0]) + model.geom(name).size[0] < radius


def test_pushing_against_everything_for_a_minute_neither_blows_up_nor_climbs_nor_sinks_in():
    posts = (Cylinder(0.4, 0.5, 0.02), Cylinder(1.6, 1.2, 0.1), Box(0.5, 1.6, 0.2, 0.1, 0.7))
    robot = robot_in(room(2.0, 2.0, Pose2(1.0, 0.8, 0.3), posts))
    rng = np.random.default_rng(1)
    heights, clearances = [], []
    for _ in range(60):
        twist = Twist2(rng.uniform(-0.5, 0.5), rng.uniform(-1.5, 1.5))
        for _ in range(10):
            robot.act(twist)
            heights.append(robot.world.data.qpos[2])
            clearances.append(robot.truth().clearance_m)
    assert robot.truth().collision_events > 3
    assert np.abs(heights).max() < 0.003
    assert min(clearances) > -0.006


def test_walls_are_solid_wherever_the_robot_goes():
    places = np.random.default_rng(4).uniform(1.0, 29.0, (150, 2))
    places = places[np.hypot(*(places - 15.0).T) > 1.0].tolist()
    for heading in np.arange(0.1, 6.0, 1.0).tolist():
        posts = tuple(Cylinder(x, y, 0.1) for x, y in places)
        robot = robot_in(room(30.0, 30.0, Pose2(15.0, 15.0, heading), posts))
        clearances = []
        for _ in range(450):
            robot.act(Twist2(0.5, 0.0))
            clearances.append(robot.truth().clearance_m)
        assert -0.006 < min(clearances) < 0.001
        assert robot.truth().collision_events >= 1
        assert robot.truth().path_length_m > 2.0


def test_a_lean_world_moves_as_the_whole_building_would():
    building = room(8.0, 3.0, Pose2(1.0, 1.5, 0.3), (Box(4.0, 2.5, 1.0, 0.2, 0.3), Cylinder(5.5, 0.6, 0.2)))
    lean, whole = World(building), building_scene(building).compile()
    data = mujoco.MjData(whole)
    rng = np.random.default_rng(0)
    touched = 0
    for _ in range(200):
        speeds = rng.uniform(2.0, 10.0, 2)
        lean.drive(*speeds.tolist())
        data.ctrl[:] = speeds
        lean.advance(20)
        for _ in range(20):
            mujoco.mj_step(whole, data)
            touched += bool(data.sensor("touching").data[0])
    assert touched > 100
    assert lean.collisions.duration_s == pytest.approx(touched * lean.step_s, rel=0.05)
    np.testing.assert_allclose(lean.data.qpos[:2], data.qpos[:2], atol=0.02)


def test_driving_into_a_wall_is_one_collision_that_lasts():
    robot = robot_in(room(4.0, 4.0, Pose2(3.0, 2.0, 0.0)))
    while robot.time_s < 10.0:
        robot.act(Twist2(0.5, 0.0))
    truth = robot.truth()
    reached_s = 0.25 + (4.0 - 0.17 - 3.0) / 0.5  # the ramp costs a quarter of a second
    assert truth.collision_events == 1
    assert truth.collision_duration_s == pytest.approx(10.0 - reached_s, abs=0.2)
    assert truth.world_from_robot.x_m == pytest.approx(4.0 - 0.17, abs=0.002)


def test_driving_on_the_floor_is_no_collision():
    robot = robot_in(room(4.0, 4.0, Pose2(2.0, 2.0, 0.0)))
    for _ in range(100):
        robot.act(Twist2(0.3, 1.0))
    assert robot.truth().collision_events == 0
    assert robot.truth().collision_duration_s == 0.0


def test_contacts_that_chatter_are_one_event_and_contacts_apart_are_two():
    collisions = Collisions(step_s=0.005, gap_s=0.1)
    for time_s in (1.0, 1.005, 1.05, 1.3):
        collisions.count(time_s)
    assert collisions.events == 2
    assert collisions.duration_s == pytest.approx(0.02)


@pytest.mark.parametrize(("index", "value"), [(0, math.nan), (2, 1e12)])
def test_a_state_gone_wrong_is_a_fault_that_names_time_and_state(index, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    world = World(room(4.0, 4.0, Pose2(2.0, 2.0, 0.0)))
    world.advance(40)
    world.data.qpos[index] = value
    with pytest.raises(PhysicsFault, match=r"t = 0\.2\d\d s.*qpos = \["):
        world.advance(4)
    assert list(tmp_path.iterdir()) == []  # MuJoCo's own log would be here


def test_a_robot_that_rested_for_long_still_obeys():
    robot = robot_in(room(4.0, 4.0, Pose2(1.0, 2.0, 0.0)))
    for _ in range(200):
        robot.act(Twist2.zero())
    assert robot.truth().path_length_m < 1e-3
    for _ in range(20):
        robot.act(Twist2(0.5, 0.0))
    assert robot.truth().path_length_m > 0.8


def test_doors_stand_open_until_their_time_and_then_bar_the_way():
    building = room(4.0, 2.0, Pose2(1.0, 1.0, 0.0), doors=(DOOR,))
    robot = robot_in(building, faults=FaultsConfig(close_doors_at_s=1.0))
    forward = 180
    before = robot.sense().scan.ranges_m[forward]
    while robot.time_s < 2.5:
        robot.act(Twist2.zero())
    assert before == pytest.approx(3.0, abs=0.01)
    assert robot.sense().scan.ranges_m[forward] == pytest.approx(0.95, abs=0.01)
    assert robot.world.doors.all_closed
    for _ in range(60):
        robot.act(Twist2(0.5, 0.0))
    assert robot.truth().world_from_robot.x_m == pytest.approx(2.0 - 0.05 - 0.17, abs=0.003)
    assert robot.truth().collision_events == 1


def test_a_door_waits_while_the_robot_stands_in_it():
    building = room(4.0, 2.0, Pose2(2.0, 1.0, 0.0), doors=(DOOR,))
    robot = robot_in(building, faults=FaultsConfig(close_doors_at_s=0.0))
    for _ in range(30):
        robot.act(Twist2.zero())
    assert robot.world.doors.height_m.tolist() == [0.0]
    for _ in range(60):
        robot.act(Twist2(0.3, 0.0))
    assert robot.world.doors.all_closed
    assert robot.truth().world_from_robot.x_m > 3.0


@pytest.mark.parametrize("closes_s", [1.36, 1.40, 1.44, 1.48, 1.52, 1.56])
def test_a_door_that_the_robot_comes_upon_is_seen_or_open(closes_s: float):
    """It has risen a little when the robot, which stops for what it sees, comes near."""
    building = room(8.0, 2.0, Pose2(2.0, 1.0, 0.0), doors=(Door(Box(3.2, 1.0, 0.05, 0.9)),))
    robot = robot_in(building, faults=FaultsConfig(close_doors_at_s=closes_s))
    for _ in range(45):
        ahead_m = robot.sense().scan.ranges_m[180]
        robot.act(Twist2(0.5 if ahead_m > 0.4 else 0.0, 0.0))
    assert robot.truth().collision_events == 0
    assert robot.world.doors.height_m[0] > LIDAR_HEIGHT_M


def test_a_door_never_touches_a_robot_that_goes_to_and_fro_through_it():
    building = room(8.0, 2.0, Pose2(2.0, 1.0, 0.0), doors=(Door(Box(4.0, 1.0, 0.05, 0.9)),))
    for closes_s in np.arange(0.0, 5.0, 0.5):
        robot = robot_in(building, faults=FaultsConfig(close_doors_at_s=float(closes_s)))
        for _ in range(70):
            ahead_m = robot.sense().scan.ranges_m[175:186].min()
            robot.act(Twist2(0.5 if ahead_m > 0.6 else 0.0, 0.0))
        assert robot.truth().collision_events == 0


def test_only_the_doors_that_are_named_close_and_unknown_ones_are_refused():
    doors = (DOOR, Door(Box(3.0, 1.0, 0.05, 0.9)))
    building = room(4.0, 2.0, Pose2(1.0, 1.0, 0.0), doors=doors)
    robot = robot_in(building, faults=FaultsConfig(close_doors_at_s=0.0, close_doors=(1,)))
    for _ in range(15):
        robot.act(Twist2.zero())
    assert robot.sense().scan.ranges_m[180] == pytest.approx(1.95, abs=0.01)
    with pytest.raises(ValueError, match="no door number 2"):
        World(building, FaultsConfig(close_doors_at_s=0.0, close_doors=(2,)))


def test_a_lifted_robot_counts_turns_of_its_wheels_and_stays_where_it_is():
    faults = FaultsConfig(lift_at_s=1.0, lift_for_s=2.0)
    robot = robot_in(room(6.0, 4.0, Pose2(1.0, 2.0, 0.0)), faults=faults)
    for _ in range(12):
        robot.act(Twist2(0.5, 0.0))
    hung = robot.truth()
    encoders_m = robot.sense().odom_from_robot.x_m
    for _ in range(17):
        robot.act(Twist2(0.5, 0.0))
    assert robot.truth().world_from_robot.distance_to(hung.world_from_robot) < 0.01
    assert robot.sense().odom_from_robot.x_m - encoders_m > 0.7
    for _ in range(20):
        robot.act(Twist2(0.5, 0.0))
    assert robot.truth().world_from_robot.distance_to(hung.world_from_robot) > 0.7


def test_distances_to_solids_agree_with_points_on_their_surface():
    box, post = Box(1.0, 2.0, 0.5, 0.2, 0.6), Cylinder(3.0, 1.0, 0.3)
    solids = SolidArrays.of([box, post])
    world_from_box = Pose2(box.x_m, box.y_m, box.yaw_rad)
    edge = np.linspace(-1.0, 1.0, 4001)
    outline = np.concatenate(
        [np.column_stack((s * 0.5 + 0 * edge, 0.2 * edge)) for s in (-1, 1)]
        + [np.column_stack((0.5 * edge, s * 0.2 + 0 * edge)) for s in (-1, 1)]
    )
    surface = world_from_box.apply(outline)
    for x, y in np.random.default_rng(0).uniform(-1.0, 5.0, (50, 2)):
        to_box, to_post = solids.distance_m(x, y)
        inside = to_box == 0.0
        assert inside or to_box == pytest.approx(np.hypot(*(surface - (x, y)).T).min(), abs=1e-3)
        assert to_post == pytest.approx(math.hypot(x - 3.0, y - 1.0) - 0.3)


def test_the_model_holds_every_solid_where_the_building_says():
    building = room(4.0, 4.0, Pose2(2.0, 2.0, 0.3), CLUTTER)
    model = building_scene(building).compile()
    solid = np.flatnonzero(model.geom_contype == 2)
    assert len(solid) == len(building.solids)
    assert model.geom_pos[solid, :2].tolist() == [[s.x_m, s.y_m] for s in building.solids]
    assert model.geom_bodyid[solid].tolist() == [0] * len(solid)
