import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from occmap.geometry import Pose2
from occmap.localization import cloud_kernels, search_kernels, surfel_kernels
from occmap.localization.likelihood_pyramid import LEVELS, LikelihoodPyramid, peak
from occmap.localization.matcher import Matcher, MatcherConfig
from occmap.localization.motion import Prediction
from occmap.localization.submap import Submap, SubmapConfig
from occmap.localization.surfel_map import Cloud
from occmap.scan import Scan
from tests.occmap.kinematic_world import room
from tests.occmap.localization.drives import scan_at

FLAT = room(8.0, 6.0, (2, 0, 3, 1.5), (6, 4, 8, 4.4))
HERE = Pose2(4.0, 3.0, 0.4)


def _cloud(boxes, pose, rng):
    return Cloud.of(scan_at(boxes, pose, rng), Pose2.identity(), 30.0)


def _ahead(boxes, pose, rng, beams):
    """Half a turn of so many beams."""
    scan = scan_at(boxes, pose, rng, beams=beams, max_range_m=30.0)
    half = np.abs(scan.bearings_rad) <= 0.5 * math.pi
    scan = replace(scan, bearings_rad=scan.bearings_rad[half], ranges_m=scan.ranges_m[half])
    return Cloud.of(scan, Pose2.identity(), 30.0)


def _submap(boxes, pose, rng, scans=12):
    """A submap whose frame is `pose`, made of scans taken there and around."""
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    for k in range(scans):
        submap_from_robot = Pose2(0.05 * k, 0.0, 0.02 * k)
        submap.insert(_cloud(boxes, pose @ submap_from_robot, rng), submap_from_robot)
    return submap


def _prediction(window_m, window_rad):
    return Prediction(Pose2.identity(), 0.2, 0.1, window_m, window_rad)


@settings(max_examples=40, deadline=None)
@given(x=st.floats(-0.3, 0.3), y=st.floats(-0.3, 0.3), yaw=st.floats(-0.17, 0.17), seed=st.integers(0, 1000))
def test_known_offsets_are_recovered_within_the_window(x, y, yaw, seed):
    rng = np.random.default_rng(seed)
    truth = Pose2(x, y, yaw)
    match = Matcher().match(
        _cloud(FLAT, HERE @ truth, rng), _submap(FLAT, HERE, rng), Pose2.identity(), _prediction(0.4, 0.25)
    )
    error = truth.inverse() @ match.submap_from_robot
    assert math.hypot(error.x_m, error.y_m) < 0.02
    assert abs(error.yaw_rad) < 0.006
    assert match.fit > 0.8


@pytest.mark.parametrize(("most_m", "is_found"), [(math.inf, True), (0.3, False)])
def test_a_second_look_goes_no_farther_than_a_robot_can(most_m, is_found):
    rng = np.random.default_rng(0)
    truth = Pose2(0.9, 0.0, 0.0)
    prediction = replace(_prediction(0.1, 0.05), most_m=most_m)
    cloud, submap = _cloud(FLAT, HERE @ truth, rng), _submap(FLAT, HERE, rng)
    match = Matcher().match(cloud, submap, Pose2.identity(), prediction)
    assert (match.submap_from_robot.distance_to(truth) < 0.02) == is_found


def test_a_corridor_holds_its_width_and_not_its_length():
    rng = np.random.default_rng(0)
    corridor = np.array([(-40, 1.0, 40, 1.2), (-40, -1.2, 40, -1.0)], float)
    match = Matcher().match(
        _cloud(corridor, Pose2.identity(), rng),
        _submap(corridor, Pose2.identity(), rng),
        Pose2.identity(),
        _prediction(0.1, 0.05),
    )
    sigma_x, sigma_y, _ = np.sqrt(np.diag(np.linalg.inv(match.information + 1e-6 * np.eye(3))))
    assert sigma_x > 5.0 * sigma_y


def test_the_faces_of_a_partition_do_not_pull_each_other():
    rng = np.random.default_rng(1)
    partition = room(12.0, 4.0, (5.95, 0, 6.05, 4))
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    left, right = Pose2(3.0, 2.0, 0.0), Pose2(9.0, 2.0, math.pi)
    for _ in range(10):
        submap.insert(_cloud(partition, left, rng), left)
    submap.insert(_cloud(partition, right, rng), right)
    guess = right @ Pose2(-0.04, 0.0, 0.0)
    match = Matcher().refine(_cloud(partition, right, rng), submap, guess, guess, np.diag([1e-3, 1e-3, 1e-3]))
    error = right.inverse() @ match.submap_from_robot
    assert abs(error.x_m) < 0.02


@pytest.mark.parametrize("seed", [4, 6, 7])
def test_wheels_that_turned_too_far_do_not_lose_a_robot_along_a_corridor(seed):
    """The turn is plain to see. Where between bare walls it was is not: a few points more prove little."""
    rng = np.random.default_rng(seed)
    corridor = np.array([(-60, 1.1, 60, 1.3), (-60, -1.3, 60, -1.1)], float)
    *before, here = (Pose2(0.25 * k, 0.3 * math.sin(0.2 * k), 0.06 * math.cos(0.2 * k)) for k in range(24))
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 50.0)
    for pose in before:
        submap.insert(_ahead(corridor, pose, rng, 360), pose)
    prediction = Prediction(Pose2(0.25, 0.0, 0.0), 0.035, 0.021, 0.65, 0.07)
    guess = here @ Pose2(0.01, 0.0, 0.034)
    match = Matcher().match(_ahead(corridor, here, rng, 360), submap, guess, prediction)
    assert match.submap_from_robot.distance_to(here) < 0.1


@pytest.mark.parametrize("off_m", [-0.14, 0.14])
def test_without_wheels_the_end_of_a_corridor_tells_how_far_the_robot_went(off_m):
    """Most points are on the side walls and fit anywhere; the few at the end are found by searching."""
    corridor = np.array([(-60, 1.1, 60, 1.3), (-60, -1.3, 60, -1.1), (11, -2, 11.2, 2)], float)
    here, blind = Pose2(1.6, 0.1, 0.0), Prediction(Pose2(0.2, 0.0, 0.0), 0.15, 0.10, 0.45, 0.3)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 50.0)
        for x in np.arange(0.0, 1.5, 0.1):
            submap.insert(_ahead(corridor, Pose2(x, 0.1, 0.02), rng, 180), Pose2(x, 0.1, 0.02))
        cloud = _ahead(corridor, here, rng, 180)
        match = Matcher().match(cloud, submap, here @ Pose2(off_m, 0.0, 0.0), blind)
        assert match.submap_from_robot.distance_to(here) < 0.1


@pytest.mark.parametrize("seed", [0, 1])
def test_what_stands_near_does_not_drag_the_far_along(seed):
    """A chair beside the robot fills a third of the scan, and was moved by 20 cm since."""
    rng = np.random.default_rng(seed)
    walls = [(-9, 1, 1.2, 1.2), (1.2, 1.3, 9, 1.5), (-9, -1.2, 9, -1), (4, 0.8, 4.4, 1.3), (6, -1, 6.3, -0.8)]
    ends = [(-9.2, -2, -9, 2), (9, -2, 9.2, 2)]

    def ahead(pose, chair):
        return _ahead(np.array([*walls, *ends, chair], float), pose, rng, 720)

    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    for x in np.arange(-1.0, 0.2, 0.1):
        submap.insert(ahead(Pose2(x, 0.5, 0.0), (0.6, 0.65, 0.7, 0.95)), Pose2(x, 0.5, 0.0))
    here, prediction = Pose2(0.6, 0.5, 0.0), Prediction(Pose2(0.15, 0.0, 0.0), 0.025, 0.01, 0.4, 0.05)
    match = Matcher().match(ahead(here, (0.8, 0.65, 0.9, 0.95)), submap, here, prediction)
    assert match.submap_from_robot.distance_to(here) < 0.03


def test_a_search_finds_what_trying_every_pose_finds():
    rng = np.random.default_rng(2)
    raster = LikelihoodPyramid(0.05, 0.06, (-5.0, -5.0), (5.0, 5.0))
    wall = rng.uniform(-3.0, 3.0, (60, 2))
    raster.insert(wall)
    points = Pose2(0.17, -0.22, 0.06).inverse().apply(wall[:30])
    half_cells, half_angles, step, cost = 7, 6, 0.02, 3.0
    found = search_kernels.search(
        raster.buffer, raster.starts, raster.shapes, points, -5.0, -5.0, 20.0, np.zeros(3),
        half_angles, step, half_cells, cost, cost, 400.0, -1e9, np.array([0, 0, -1]),
    )  # fmt: skip
    fine = raster.buffer[: 200 * 200].reshape(200, 200).astype(int)
    best = -math.inf
    for a in range(-half_angles, half_angles + 1):
        cells = np.floor((Pose2(0.0, 0.0, a * step).apply(points) + 5.0) * 20.0).astype(int)
        for y in range(-half_cells, half_cells + 1):
            for x in range(-half_cells, half_cells + 1):
                score = fine[cells[:, 1] + y, cells[:, 0] + x].sum() - min(
                    cost * (x * x + y * y + a * a), 400.0
                )
                best = max(best, score)
    assert found[3] == best


def test_every_level_bounds_the_one_below_it():
    rng = np.random.default_rng(3)
    raster = LikelihoodPyramid(0.05, 0.06, (0.0, 0.0), (4.0, 3.0))
    raster.insert(rng.uniform(0.2, 2.8, (40, 2)))
    levels = [
        raster.buffer[s : s + ny * nx].reshape(ny, nx)
        for s, (ny, nx) in zip(raster.starts, raster.shapes, strict=True)
    ]
    fine = levels[0]
    for k in range(1, LEVELS):
        h = 1 << k
        for iy, ix in np.argwhere(fine > 0):
            for j in (iy // h, iy // h + 1):
                for i in (ix // h, ix // h + 1):
                    assert levels[k][j, i] >= fine[iy, ix]


def test_a_point_leaves_a_peak_in_its_cell():
    raster = LikelihoodPyramid(0.05, 0.06, (0.0, 0.0), (1.0, 1.0))
    raster.insert(np.array([[0.51, 0.32]]))
    fine = raster.buffer[:400].reshape(20, 20)
    assert np.unravel_index(fine.argmax(), fine.shape) == (6, 10)
    assert fine.max() == 255 == peak(1.2)[0, 0]


def test_thinned_points_keep_their_distance():
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.normal(0.0, 0.05, (200, 2)), axis=0)
    kept, last = [], None
    for point in points:
        if last is None or math.dist(point, last) >= 0.1:
            kept.append(point)
            last = point
    assert np.array_equal(points[cloud_kernels.spaced(points, 0.1)], np.array(kept))


def test_normal_equations_are_the_gradient_of_the_cost():
    """Half the sum of squared point-to-line residuals, by finite differences, on one flat wall."""
    wall = np.column_stack((np.linspace(-1.0, 1.0, 200), np.full(200, 1.0)))
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 5.0)
    down = np.tile([0.0, -1.0], (200, 1))
    submap.insert(Cloud(wall, down), Pose2.identity())
    points, m = wall[40:160:7] + np.array([0.0, 0.01]), submap.surfels

    def linearised(pose):
        hessian, gradient = np.zeros((3, 3)), np.zeros(3)
        surfel_kernels.linearise(
            m.index, m.rows, *m.origin_m, m.voxels_per_m, points, down[: len(points)], pose, 1e6, hessian,
            gradient,
        )  # fmt: skip
        return gradient

    def cost(pose):
        moved = Pose2(*pose).apply(points)
        return 0.5 * ((moved[:, 1] - 1.0) ** 2).sum()

    pose, eps = np.array([0.01, 0.005, 0.01]), 1e-6
    numeric = [(cost(pose + eps * e) - cost(pose - eps * e)) / (2 * eps) for e in np.eye(3)]
    assert linearised(pose) == pytest.approx(np.array(numeric), abs=1e-4)


def two_walls(rng, noise_m):
    """What is seen of a bare corridor, 2.4 m wide, from somewhere along it."""
    bearings = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    ranges = 1.2 / np.maximum(np.abs(np.sin(bearings)), 1e-9)
    ranges = np.where(ranges < 12.0, ranges + noise_m * rng.standard_normal(360), np.inf)
    return Cloud.of(Scan(bearings, ranges, 12.0), Pose2.identity(), 60.0)


@pytest.mark.parametrize("noise_m", [0.02, 0.03, 0.06])
def test_along_a_bare_corridor_noise_tells_nothing(noise_m):
    rng, submap = np.random.default_rng(1), Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    for k in range(20):
        submap.insert(two_walls(rng, noise_m), Pose2(0.05 * k, 0.0, 0.0))
    guess, prior = Pose2(1.2, 0.0, 0.0), np.diag([100.0, 100.0, 1e4])
    match = Matcher().refine(two_walls(rng, noise_m), submap, guess, guess, prior)
    assert match.submap_from_robot.x_m == pytest.approx(guess.x_m, abs=2e-3)
    assert match.information[0, 0] < 1e-3 * match.information[1, 1]
    assert not match.tells(0.1)


def test_a_finished_submap_loses_no_surfels():
    rng, submap = np.random.default_rng(2), Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    for k in range(20):
        submap.insert(two_walls(rng, 0.02), Pose2(0.05 * k, 0.013 * k, 0.02 * k))
    submap.finish()
    assert np.count_nonzero(submap.surfels.index >= 0) == len(submap.cloud)


@pytest.mark.parametrize("value", [0.0, -0.05, math.nan, math.inf])
def test_a_length_that_is_none_is_refused_by_name(value):
    with pytest.raises(ValueError, match=r"SubmapConfig\.voxel_m must be positive"):
        SubmapConfig(voxel_m=value)
    with pytest.raises(ValueError, match=r"MatcherConfig\.sigma_m must be positive"):
        MatcherConfig(sigma_m=value)
