"""Laws of the compass made of walls: exact to hundredths of a degree, silent where it knows nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import compass_kernels as kernels
from occmap.localization.compass import QUARTER, Compass, CompassConfig
from occmap.localization.pose_graph import PoseGraph
from occmap.localization.submap import Submap, SubmapConfig
from occmap.localization.surfel_map import PackedSurfels
from occmap.localization.surfel_rows import COLUMNS, COUNT, FLATNESS, MEAN, NORMAL, VIEW

CONFIG = CompassConfig()
SPACING_M = 0.05
DRIFT_RAD = 0.0015


def wall(start, end, facing: float, rng: np.random.Generator, off_m: float = 0.01):
    """(n, COLUMNS) surfels of a wall from a place (x, y) to another, seen from its left (1) or right (-1)."""
    a, b = np.array(start), np.array(end)
    length = float(np.hypot(*(b - a)))
    t = np.arange(0.0, length, SPACING_M)[:, None] / length
    normal = facing * np.array([-(b - a)[1], (b - a)[0]]) / length
    rows = np.zeros((len(t), COLUMNS))
    rows[:, MEAN] = a + t * (b - a) + off_m * rng.standard_normal((len(t), 1)) * normal
    rows[:, NORMAL] = normal
    rows[:, FLATNESS], rows[:, COUNT], rows[:, VIEW] = 0.95, 8.0, normal
    return rows


def turned(rows, yaw_rad: float):
    turn, out = Pose2(0.0, 0.0, yaw_rad), rows.copy()
    for columns in (MEAN, NORMAL, VIEW):
        out[:, columns] = turn.apply(np.ascontiguousarray(rows[:, columns]))
    return out


def rooms(rng: np.random.Generator):
    """(n, COLUMNS) surfels of a room and a corridor beyond its door."""
    corners = [
        ((0, 0), (6, 0)), ((6, 0), (6, 2)), ((6, 3), (6, 5)), ((6, 5), (0, 5)), ((0, 5), (0, 0)),
        ((6.1, 5), (6.1, -4)), ((8, -4), (8, 9)),
    ]  # fmt: skip
    return np.concatenate([wall(a, b, 1.0, rng) for a, b in corners])


def off_deg(yaw_rad: float, true_rad: float) -> float:
    return math.degrees((yaw_rad - true_rad + 0.5 * QUARTER) % QUARTER - 0.5 * QUARTER)


def compass(
    *turns_rad: float, told_rad: float = 0.0, drift_rad: float = DRIFT_RAD
) -> tuple[Compass, PoseGraph]:
    """Of submaps that each show the rooms, turned; the graph has walked by told_rad in each."""
    rng, graph = np.random.default_rng(1), PoseGraph()
    clouds = [PackedSurfels.of(turned(rooms(rng), t).astype(np.float32)) for t in turns_rad]
    submaps = [Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0, cloud=cloud) for cloud in clouds]
    step = Pose2(2.0, 0.0, told_rad)
    for k in range(len(submaps)):
        graph.add_node(graph.pose(k - 1) @ step if k else Pose2.identity())
        if k:
            graph.add_edge(k - 1, k, step, np.diag([1e4, 1e4, 1.0 / drift_rad**2]))
    return Compass(CONFIG, graph, submaps), graph


@pytest.mark.parametrize("seed", range(8))
def test_walls_tell_the_direction_that_they_run_along(seed):
    rng = np.random.default_rng(seed)
    yaw = rng.uniform(-math.pi, math.pi)
    found = compass()[0].direction(turned(rooms(rng), yaw), CONFIG.cell_m)
    assert found is not None
    assert abs(off_deg(found.yaw_rad, yaw)) < 0.05


@pytest.mark.parametrize("expected_off_deg", [-0.4, -0.1, 0.2, 0.4])
def test_an_expectation_nearby_leads_to_the_same_direction(expected_off_deg):
    rows = turned(rooms(np.random.default_rng(3)), 0.3)
    found = compass()[0].direction(rows, CONFIG.cell_m, 0.3 + math.radians(expected_off_deg))
    assert found is not None
    assert abs(off_deg(found.yaw_rad, 0.3)) < 0.05


def test_a_cupboard_let_into_a_wall_does_not_turn_north():
    """A wall and a front beside it, 4 cm deeper, were taken for one line, askew by half a degree."""
    rng = np.random.default_rng(7)
    walls = [((0, 0), (3.4, 0)), ((3.4, -0.043), (6, -0.043)), ((0, 2), (0, 0)), ((5.5, 3), (3.5, 3))]
    rows = turned(np.concatenate([wall(a, b, 1.0, rng, 0.004) for a, b in walls]), 0.3)
    found = compass()[0].direction(rows, CONFIG.still_cell_m)
    assert found is not None
    assert abs(off_deg(found.yaw_rad, 0.3)) < 0.1


def test_a_round_room_has_no_direction():
    angles = np.arange(0.0, 2.0 * math.pi, 0.01)
    normal = -np.column_stack((np.cos(angles), np.sin(angles)))
    rows = np.column_stack((-5.0 * normal, normal, np.full((len(angles), 2), (0.9, 8.0)), normal))
    assert compass()[0].direction(rows, CONFIG.cell_m) is None
    assert compass()[0].direction(np.empty((0, 8)), CONFIG.cell_m) is None


def test_a_heading_that_walked_a_little_is_pulled_straight():
    walked = math.radians(0.08)
    it, graph = compass(0.2, 0.2, told_rad=walked)  # the walls say that nothing has turned
    it.look(0)
    it.look(1)
    it.look(1)
    graph.optimise()
    chain, walls = 1.0 / DRIFT_RAD**2, 1.0 / CONFIG.floor_rad**2
    assert graph.pose(1).yaw_rad == pytest.approx(walked * chain / (chain + walls), abs=0.2 * walked)


def test_walls_that_run_otherwise_turn_nothing():
    askew = math.radians(2.0)
    it, graph = compass(0.2, 0.2 - askew, told_rad=askew)
    tilted, beside = compass(0.2, 0.2 - askew - math.radians(0.7), told_rad=askew)
    for each in (it, tilted):
        each.look(0)
        each.look(1)
    graph.optimise()
    beside.optimise()
    assert graph.pose(1).yaw_rad == pytest.approx(askew, abs=math.radians(0.05))
    assert beside.pose(1).yaw_rad == pytest.approx(askew, abs=math.radians(0.05))


@pytest.mark.parametrize("first_deg", [0.5, -0.5, 0.0])
def test_a_first_room_that_stands_askew_bends_none_of_the_others(first_deg):
    it, graph = compass(0.2 + math.radians(first_deg), *[0.2] * 6, drift_rad=2.0 * DRIFT_RAD)
    for k in range(7):
        it.look(k, is_still=k == 0)
        it.look(max(0, k - 1))
        graph.optimise()
    assert np.abs(graph.poses[:, 2]).max() < math.radians(0.05)  # nothing has turned


def test_one_room_that_stands_askew_does_not_turn_north():
    tilted = 0.2 + math.radians(0.8)
    it, graph = compass(0.2, 0.2, 0.2, tilted, 0.2, told_rad=math.radians(0.05), drift_rad=2.0 * DRIFT_RAD)
    for k in range(5):
        it.look(k)
    graph.optimise()
    assert it._north == 0
    assert np.abs(graph.poses[:, 2]).max() < math.radians(0.1)  # it walked by 0.2 degrees in all


def test_small_errors_of_many_walls_do_not_add_up_to_another_north():
    """In three mazes of a hundred they had: north was then no longer where the robot had stood and looked."""
    off_rad = math.radians(0.1) * np.random.default_rng(4).standard_normal(30)
    it, _ = compass(0.2, *(0.2 + off_rad))
    for k in range(31):
        it.look(k)
    assert it._north == 0


def test_walls_that_are_lost_again_say_nothing_any_more():
    walked = math.radians(0.08)
    it, graph = compass(0.2, 0.2, told_rad=walked)
    it.look(0)
    it.look(1)
    it._submaps[1].cloud = PackedSurfels.of(np.empty((0, 8), np.float32))
    it.look(1)
    graph.optimise()
    assert graph.pose(1).yaw_rad == pytest.approx(walked, abs=1e-6)


def test_offsets_are_a_histogram():
    rows, yaw, cell_m, reach_m = rooms(np.random.default_rng(5)), 0.1, 0.05, 12.0
    histogram, twin = np.empty((4, 482)), np.zeros((4, 482))
    total = kernels.offsets(rows, yaw, math.cos(0.26), 2.0, cell_m, reach_m, histogram)
    for side in range(4):
        axis = np.array([math.cos(yaw + side * QUARTER), math.sin(yaw + side * QUARTER)])
        sign = 1.0 if side < 2 else -1.0  # offsets are those of the axis, not of the side
        place = (sign * (rows[:, MEAN] @ axis) + reach_m) / cell_m
        for p in np.flatnonzero(rows[:, NORMAL] @ axis > math.cos(0.26)):
            k = math.floor(place[p])
            twin[side, k] += 8.0 * (1.0 - (place[p] - k))
            twin[side, k + 1] += 8.0 * (place[p] - k)
    assert total == 8.0 * len(rows)
    assert np.allclose(histogram, twin)


def test_straightening_is_the_least_squares_slope_of_a_wall():
    rng, yaw = np.random.default_rng(6), 0.002
    rows = turned(wall((-5.0, 2.0), (5.0, 2.0), 1.0, rng), yaw)
    slope = np.polyfit(rows[:, 0], rows[:, 1], 1)[0]
    found, inertia, share = kernels.straighten(rows, 0.0, 4, math.cos(0.26), 2.0, 0.1, 12.0, 30.0)
    assert found == pytest.approx(math.atan(slope), abs=1e-6)
    assert share == pytest.approx(1.0)
    assert inertia == pytest.approx(8.0 * len(rows) * np.var(rows[:, 0]), rel=1e-4)
