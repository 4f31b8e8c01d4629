"""A lidar that agrees with trigonometry, and errors that are as large as they say."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from occmap.geometry import Pose2, Twist2
from sim.building import Box, Building, Cylinder
from sim.faults import FaultsConfig
from sim.lidar import LidarConfig
from sim.lidar_noise import LidarNoise, LidarNoiseConfig, LidarStreams
from sim.ray_scene import RayScene
from sim.ray_slots import RaySlots
from sim.scene import building_scene
from sim.solids import SolidArrays
from sim.umbra import hidden
from tests.sim.rooms import EXACT, robot_in, room

SILENT = LidarNoiseConfig().scaled(0.0)
NOTHING = SolidArrays.of([])


def spoil(config: LidarNoiseConfig, exact_m: np.ndarray, seed: int = 0) -> np.ndarray:
    return LidarNoise(config, LidarStreams.spawned(np.random.default_rng(seed))).spoil(exact_m, 0.05, 12.0)


def clutter(rng: np.random.Generator, count: int, size_m: float) -> list[Box | Cylinder]:
    places = rng.uniform(0.0, size_m, (count, 2)).tolist()
    return [
        Box(x, y, rng.uniform(0.05, 1.5), rng.uniform(0.05, 0.3), rng.uniform(-3.0, 3.0))
        if rng.random() < 0.6
        else Cylinder(x, y, rng.uniform(0.02, 0.3))
        for x, y in places
    ]


@pytest.mark.parametrize("start", [Pose2(1.0, 1.5, 0.0), Pose2(5.2, 3.1, 0.7), Pose2(3.0, 0.5, -2.9)])
def test_an_empty_room_equals_trigonometry(start):
    robot = robot_in(room(6.0, 4.0, start))
    scan = robot.sense().scan
    angle = start.yaw_rad + scan.bearings_rad
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angle) > 0, 6.0 - start.x_m, -start.x_m) / np.cos(angle)
        to_y = np.where(np.sin(angle) >= 0, 4.0 - start.y_m, -start.y_m) / np.sin(angle)
    np.testing.assert_allclose(scan.ranges_m, np.minimum(to_x, to_y), atol=1e-9)


def test_a_round_column_equals_trigonometry():
    robot = robot_in(room(20.0, 20.0, Pose2(4.0, 10.0, 0.0), (Cylinder(7.0, 10.0, 0.5),)))
    scan = robot.sense().scan
    bearing = scan.bearings_rad[np.abs(scan.bearings_rad) < math.asin(0.5 / 3.0) - 1e-6]
    expected = 3.0 * np.cos(bearing) - np.sqrt(0.25 - (3.0 * np.sin(bearing)) ** 2)
    found = scan.ranges_m[np.abs(scan.bearings_rad) < math.asin(0.5 / 3.0) - 1e-6]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_an_empty_world_is_free_as_far_as_the_lidar_reaches():
    nowhere = Building("nowhere", "test", (-1.0, -1.0), (1.0, 1.0), (), Pose2.identity())
    robot = robot_in(nowhere)
    assert np.isinf(robot.sense().scan.ranges_m).all()
    assert robot.truth().clearance_m == 5.0


def test_low_solids_are_passed_over():
    step = Box(3.0, 2.0, 0.2, 0.5, height_m=0.15)
    assert robot_in(room(6.0, 4.0, Pose2(1.0, 2.0, 0.0), (step,))).sense().scan.ranges_m[
        180
    ] == pytest.approx(5.0)


def test_what_is_out_of_range_is_inf():
    scan = robot_in(room(40.0, 4.0, Pose2(20.0, 2.0, 0.0))).sense().scan
    assert scan.ranges_m[180] == math.inf
    assert scan.ranges_m[270] == pytest.approx(2.0)
    assert np.nanmax(scan.ranges_m[np.isfinite(scan.ranges_m)]) <= 12.0


@pytest.mark.parametrize("few", [0, 200])
def test_rays_among_the_solids_that_matter_equal_rays_in_the_whole_building(few, monkeypatch):
    monkeypatch.setattr("sim.ray_scene.FEW", few)
    rng = np.random.default_rng(3)
    building = room(40.0, 40.0, Pose2(20.0, 20.0, 0.0), tuple(clutter(rng, 400, 40.0)))
    spec = building_scene(building)
    spec.delete(spec.body("robot"))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    rays = RayScene(SolidArrays.of(building.solids), 12.0, 0.2)
    angles = np.linspace(-4.0, 4.0, 101)
    place = np.array([20.0, 20.0])
    for _ in range(60):  # a walk of many refills
        place += rng.uniform(-0.8, 0.9, 2)
        expected = [ray(model, data, place, angle) for angle in angles]
        np.testing.assert_allclose(rays.cast(place[0], place[1], angles, NOTHING), expected, atol=1e-9)


def test_no_beam_from_around_a_place_ends_on_a_solid_that_was_called_hidden():
    rng = np.random.default_rng(5)
    angles = np.linspace(-math.pi, math.pi, 720)
    share_hidden = []
    for wander_m in (0.2, 1.0, 0.5) * 4:
        walls = [
            Box(x, y, rng.uniform(0.3, 4.0), 0.06, rng.choice([0.0, 0.5 * math.pi, rng.uniform(-3.0, 3.0)]))
            for x, y in rng.uniform(0.0, 24.0, (60, 2)).tolist()
        ]
        solids = SolidArrays.of(walls + clutter(rng, 40, 24.0))
        place = rng.uniform(6.0, 18.0, 2)
        out_of_sight = hidden(solids, place[0], place[1], wander_m)
        share_hidden.append(out_of_sight.mean())
        every, some = (SolidsAtOnce(s) for s in (solids, solids.take(np.flatnonzero(~out_of_sight))))
        for turn, away in zip(rng.uniform(0.0, 6.3, 25), np.sqrt(rng.uniform(0.0, 1.0, 25)), strict=True):
            x, y = place + wander_m * away * np.array([math.cos(turn), math.sin(turn)])
            np.testing.assert_array_equal(every.cast(x, y, angles), some.cast(x, y, angles))
    assert np.mean(share_hidden) > 0.3


class SolidsAtOnce:
    """Rays against every one of some solids."""

    def __init__(self, solids: SolidArrays) -> None:
        self._slots = RaySlots(len(solids))
        self._slots.write(0, solids)

    def cast(self, x: float, y: float, angles: np.ndarray) -> np.ndarray:
        directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)))
        return self._slots.cast((x, y, 0.2), directions, 100.0)[0]


def ray(model: mujoco.MjModel, data: mujoco.MjData, place: np.ndarray, angle: float) -> float:
    """One ray of the slow kind, in the compiled building."""
    direction, hit = np.array([math.cos(angle), math.sin(angle), 0.0]), np.zeros(1, dtype=np.int32)
    distance = mujoco.mj_ray(model, data, np.array([*place, 0.2]), direction, None, True, -1, hit)
    return distance if 0.0 <= distance <= 12.0 else math.inf


def test_beams_cover_the_field_of_view_counter_clockwise():
    full = LidarConfig(beams=8).bearings_rad()
    assert np.rad2deg(full).tolist() == pytest.approx([-180, -135, -90, -45, 0, 45, 90, 135])
    half = LidarConfig(beams=5, field_of_view_rad=math.pi).bearings_rad()
    assert np.rad2deg(half).tolist() == pytest.approx([-90, -45, 0, 45, 90])


def test_no_noise_changes_nothing():
    exact = np.array([0.3, 5.0, 11.9, np.inf])
    assert spoil(SILENT, exact).tolist() == exact.tolist()


def spoiled_by_arrays(config: LidarNoiseConfig, exact_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The noise kernel's twin."""
    streams, count = LidarStreams.spawned(rng), len(exact_m)
    reach_m = np.minimum(exact_m, 12.0)
    sigma_m = config.range_sigma_m + config.range_sigma_share * reach_m
    measured = reach_m + sigma_m * streams.range_error.standard_normal(count)
    measured[exact_m > 12.0] = np.inf
    chance = streams.short.random(count)
    early = 0.05 + chance / max(config.short_rate, 1e-9) * np.maximum(reach_m - 0.05, 0.0)
    measured = np.where(chance < config.short_rate, early, measured)
    measured[streams.miss.random(count) < config.miss_rate] = np.inf
    if config.quantum_m > 0.0:
        measured = np.rint(measured / config.quantum_m) * config.quantum_m
    measured = np.maximum(measured, 0.0)
    measured[measured >= 12.0] = np.inf
    measured[streams.dropout.random(count) < config.dropout_rate] = np.nan
    return measured


@pytest.mark.parametrize("scale", [0.0, 0.5, 1.0, 20.0])
def test_the_noise_kernel_equals_its_twin_bit_by_bit(scale: float):
    exact = np.random.default_rng(3).uniform(0.0, 14.0, 2000)
    exact[:3] = np.inf, 12.0, 0.0
    config = LidarNoiseConfig().scaled(scale)
    np.testing.assert_array_equal(
        spoil(config, exact, seed=5), spoiled_by_arrays(config, exact, np.random.default_rng(5))
    )


@pytest.mark.parametrize("range_m", [1.0, 8.0])
def test_the_range_error_has_the_spread_it_says(range_m):
    error = spoil(
        replace(LidarNoiseConfig(), dropout_rate=0, short_rate=0, miss_rate=0), np.full(20000, range_m)
    )
    error -= range_m
    assert error.std() == pytest.approx(0.02 + 0.005 * range_m, rel=0.03)
    assert abs(error.mean()) < 1e-3


def test_rates_are_as_often_as_they_say():
    measured = spoil(LidarNoiseConfig(), np.full(100_000, 5.0))
    assert np.isnan(measured).mean() == pytest.approx(0.01, rel=0.15)
    assert np.isinf(measured).mean() == pytest.approx(0.005, rel=0.2)
    short = measured[np.isfinite(measured) & (measured < 4.7)]
    assert len(short) / len(measured) == pytest.approx(0.005, rel=0.2)
    assert short.min() >= 0.05


def test_ranges_come_in_steps():
    measured = spoil(replace(SILENT, quantum_m=0.05), np.linspace(0.1, 11.0, 200))
    np.testing.assert_allclose(measured / 0.05, np.round(measured / 0.05), atol=1e-9)


@pytest.mark.parametrize("source", ["range_sigma_m", "dropout_rate", "short_rate", "miss_rate"])
def test_changing_one_source_of_error_leaves_the_others_alone(source):
    exact = np.random.default_rng(0).uniform(1.0, 11.0, 5000)
    usual = LidarNoiseConfig(quantum_m=0.0)
    changed = spoil(replace(usual, **{source: 0.3}), exact)
    before = spoil(usual, exact)
    without = spoil(replace(usual, **{source: 0.0}), exact)
    if source == "range_sigma_m":
        assert np.array_equal(np.isnan(changed), np.isnan(before))
        assert np.array_equal(np.isinf(changed), np.isinf(before))
    else:
        # Where the changed source says nothing, the same beams say the same.
        untouched = (changed == without) | (np.isnan(changed) & np.isnan(without))
        assert untouched.mean() == pytest.approx(0.7, abs=0.03)
        assert np.count_nonzero((before != without) & ~np.isnan(before) & untouched) == 0


def test_scaling_scales_every_level_and_no_rate_beyond_one():
    twice = LidarNoiseConfig().scaled(2.0)
    assert (twice.range_sigma_m, twice.dropout_rate, twice.miss_rate) == (0.04, 0.02, 0.01)
    assert LidarNoiseConfig().scaled(1000.0).dropout_rate == 1.0
    assert LidarNoiseConfig().scaled(1.0) == LidarNoiseConfig()


def test_a_spinning_lidar_at_rest_sees_what_a_snapshot_sees():
    building = room(6.0, 4.0, Pose2(2.0, 1.0, 0.4))
    spinning = robot_in(building, lidar=replace(EXACT, spin=True)).sense().scan
    np.testing.assert_allclose(spinning.ranges_m, robot_in(building).sense().scan.ranges_m, atol=1e-9)
    assert spinning.beam_times_s is not None
    assert spinning.beam_times_s[-1] == 0.0
    assert spinning.beam_times_s[0] == pytest.approx(-0.1, abs=0.001)
    assert robot_in(building).sense().scan.beam_times_s is None


@pytest.mark.parametrize("twist", [Twist2(0.5, 0.0), Twist2(0.0, 1.5), Twist2(0.4, -1.2)])
def test_beams_put_back_to_their_own_instant_lie_on_the_walls(twist):
    """Deskewing with the true twist flattens what the motion has bent."""
    robot = robot_in(room(6.0, 4.0, Pose2(2.0, 1.5, 0.4)), lidar=replace(EXACT, spin=True))
    for _ in range(15):
        robot.act(twist)
    scan, truth = robot.sense().scan, robot.truth()
    assert scan.beam_times_s is not None

    def off_the_walls(times_s: np.ndarray) -> float:
        distances = []
        for bearing, range_m, t in zip(scan.bearings_rad, scan.ranges_m, times_s, strict=True):
            v, w = truth.twist.linear_mps, truth.twist.angular_radps
            back = Pose2(v * t * np.sinc(w * t / 2 / np.pi), v * t * w * t / 2, w * t)
            beam = np.array([[range_m * math.cos(bearing), range_m * math.sin(bearing)]])
            (x, y), *_ = (truth.world_from_robot @ back).apply(beam)
            distances.append(min(abs(x), abs(6.0 - x), abs(y), abs(4.0 - y)))
        return max(distances)

    assert off_the_walls(scan.beam_times_s) < 0.006
    assert off_the_walls(np.zeros_like(scan.beam_times_s)) > 0.03


def test_a_turn_may_last_as_long_as_it_likes():
    """Each beam of a slow lidar starts from where the robot was then."""
    lidar = replace(EXACT, spin=True, rate_hz=0.125, beams=8)
    robot = robot_in(room(6.0, 4.0, Pose2(2.0, 2.0, 0.0)), lidar=lidar)
    robot.act(Twist2(0.2, 0.0))
    travelled_m = robot.truth().path_length_m
    back, ahead = robot.sense().scan.ranges_m[[0, 4]]  # after an eighth of the turn, and after five
    assert back - 2.0 == pytest.approx(travelled_m / 8.0, abs=0.02)
    assert 6.0 - ahead - 2.0 == pytest.approx(travelled_m * 5.0 / 8.0, abs=0.02)


def test_a_trail_says_so_when_it_is_asked_for_what_it_has_not_kept():
    robot = robot_in(room(6.0, 4.0, Pose2(2.0, 2.0, 0.0)))
    for _ in range(3):
        robot.act(Twist2.zero())
    with pytest.raises(ValueError, match=r"asked for t = 0\.05"):
        robot.world.trail.at(np.array([0.05]))


def test_a_blind_lidar_says_nothing_and_recovers():
    robot = robot_in(
        room(6.0, 4.0, Pose2(2.0, 1.0, 0.4)), faults=FaultsConfig(blind_at_s=0.5, blind_for_s=0.5)
    )
    silent = []
    for _ in range(15):
        silent.append(bool(np.isnan(robot.sense().scan.ranges_m).all()))
        robot.act(Twist2.zero())
    assert silent == [False] * 5 + [True] * 5 + [False] * 5


@pytest.mark.parametrize(
    "mistake",
    [
        {"beams": 0},
        {"max_range_m": -1.0},
        {"min_range_m": 20.0},
        {"field_of_view_rad": 7.0},
        {"rate_hz": 0.0},
    ],
)
def test_nonsense_is_refused_with_its_value(mistake):
    with pytest.raises(ValueError, match=str(next(iter(mistake.values())))):
        LidarConfig(**mistake)


@pytest.mark.parametrize("mistake", [{"range_sigma_m": -0.1}, {"dropout_rate": 1.2}, {"quantum_m": math.nan}])
def test_nonsense_levels_are_refused_with_their_value(mistake):
    with pytest.raises(ValueError, match=str(next(iter(mistake.values())))):
        LidarNoiseConfig(**mistake)
