"""Laws of the pose graph: gauge, truth, Jacobians, losses, covariance, growing."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from occmap.geometry import Pose2, wrap_angle
from occmap.localization import pose_graph_kernels as kernels
from occmap.localization.normal_equations import NormalEquations, block_pattern
from occmap.localization.pose_graph import Loss, PoseGraph

INFORMATION = np.diag([400.0, 100.0, 900.0]) + 20.0


def as_row(pose: Pose2) -> np.ndarray:
    return np.array((pose.x_m, pose.y_m, pose.yaw_rad))


def random_pose(rng: np.random.Generator, spread_m: float = 3.0) -> Pose2:
    x, y = rng.normal(0.0, spread_m, 2)
    return Pose2(x, y, rng.uniform(-math.pi, math.pi))


def noisy(pose: Pose2, rng: np.random.Generator, sigma: float) -> Pose2:
    return pose @ Pose2(*rng.normal(0.0, sigma, 3))


def loop(rng: np.random.Generator, nodes: int = 40, noise: float = 0.0) -> tuple[PoseGraph, list[Pose2]]:
    """A circle driven once round and closed, started from its own (noisy) odometry; and the truth."""
    step = Pose2(1.0, 0.0, 2.0 * math.pi / nodes)
    truth = [Pose2.identity()]
    graph = PoseGraph()
    graph.add_node(truth[0])
    for i in range(nodes - 1):
        truth.append(truth[-1] @ step)
        measured = noisy(step, rng, noise)
        graph.add_node(graph.pose(i) @ measured)
        graph.add_edge(i, i + 1, measured, INFORMATION)
    for i, j in ((nodes - 1, 0), (nodes // 2, 2), (nodes - 5, 7)):
        graph.add_edge(i, j, noisy(truth[i].inverse() @ truth[j], rng, noise), INFORMATION)
    return graph, truth


def test_error_is_zero_at_the_truth_and_the_optimiser_stays_there():
    graph, truth = loop(np.random.default_rng(0))
    assert graph.cost() < 1e-20
    assert graph.optimise().converged
    np.testing.assert_allclose(graph.poses, [as_row(p) for p in truth], atol=1e-9)


def test_perfect_edges_pull_scattered_nodes_to_the_truth():
    rng = np.random.default_rng(1)
    graph, truth = loop(rng)
    for k in range(1, len(truth)):
        graph.poses[k] = as_row(noisy(truth[k], rng, 0.3))
    graph.optimise()
    np.testing.assert_allclose(graph.poses, [as_row(p) for p in truth], atol=1e-6)


def test_where_the_first_node_is_put_changes_nothing_but_the_frame():
    plain, _ = loop(np.random.default_rng(2), noise=0.05)
    moved, _ = loop(np.random.default_rng(2), noise=0.05)
    gauge = Pose2(-3.0, 7.0, 2.5)
    for k in range(len(moved.poses)):
        moved.poses[k] = as_row(gauge @ moved.pose(k))
    first = moved.pose(0)
    a, b = plain.optimise(), moved.optimise()
    assert moved.pose(0) == first
    assert b.cost == pytest.approx(a.cost, rel=1e-9)
    for k in range(len(plain.poses)):
        expected = gauge @ plain.pose(k)
        assert moved.pose(k).distance_to(expected) < 1e-5
        assert abs(wrap_angle(moved.pose(k).yaw_rad - expected.yaw_rad)) < 1e-6


def test_jacobians_equal_finite_differences():
    rng = np.random.default_rng(3)
    h = 1e-6
    for _ in range(50):
        pose_i, pose_j = random_pose(rng), random_pose(rng)
        z = as_row(pose_i.inverse() @ noisy(pose_j, rng, 0.3))
        jacobians = np.empty((3, 3)), np.empty((3, 3))
        kernels.edge_jacobians(as_row(pose_i), as_row(pose_j), z, *jacobians)
        for which, jacobian in enumerate(jacobians):
            for axis in range(3):
                errors = []
                for sign in (1.0, -1.0):
                    poses = [pose_i, pose_j]
                    poses[which] = poses[which] @ Pose2(*(sign * h * np.eye(3)[axis]))
                    error = np.empty(3)
                    kernels.edge_error(as_row(poses[0]), as_row(poses[1]), z, error)
                    errors.append(error)
                np.testing.assert_allclose((errors[0] - errors[1]) / (2.0 * h), jacobian[:, axis], atol=1e-7)


@pytest.mark.parametrize("loss", list(Loss))
def test_a_loss_s_weight_is_its_derivative(loss: Loss):
    for chi2 in (0.1, 3.9, 4.1, 30.0, 1e4):
        h = 1e-5 * chi2
        up, down = (
            kernels.robust_cost_and_weight(chi2 + sign * h, int(loss), 4.0)[0] for sign in (1.0, -1.0)
        )
        assert kernels.robust_cost_and_weight(chi2, int(loss), 4.0)[1] == pytest.approx(
            (up - down) / (2 * h), rel=1e-3
        )


def test_assembly_equals_dense_normal_equations():
    """Edges in both directions, twice between one pair, and at a second fixed node."""
    rng = np.random.default_rng(4)
    graph = PoseGraph()
    for _ in range(7):
        graph.add_node(random_pose(rng))
    for i, j in ((0, 1), (2, 1), (1, 2), (1, 2), (5, 3), (3, 4), (6, 5), (6, 0), (2, 6), (0, 4)):
        graph.add_edge(i, j, random_pose(rng), INFORMATION, Loss.DCS, 5.0)
    slot = np.array([-1, 0, 1, 2, -1, 3, 4])
    pattern = block_pattern(slot, graph.ends)
    equations = NormalEquations(pattern)
    loss, scale = np.full(10, int(Loss.DCS)), np.full(10, 5.0)
    kernels.linearise(
        graph.poses, graph.ends, graph.measured, graph.information, loss, scale, slot,
        pattern.column_start, pattern.blocks_above, pattern.edge_block, equations.hessian, equations.gradient,
    )  # fmt: skip

    dense, gradient = np.zeros((15, 15)), np.zeros(15)
    for (i, j), z, chi2 in zip(graph.ends, graph.measured, graph.chi2(), strict=True):
        error, by_i, by_j = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
        kernels.edge_error(graph.poses[i], graph.poses[j], z, error)
        kernels.edge_jacobians(graph.poses[i], graph.poses[j], z, by_i, by_j)
        jacobian = np.zeros((3, 15))
        for node, block in ((i, by_i), (j, by_j)):
            if slot[node] >= 0:
                jacobian[:, 3 * slot[node] : 3 * slot[node] + 3] += block
        weighted = INFORMATION * kernels.robust_cost_and_weight(chi2, int(Loss.DCS), 5.0)[1]
        dense += jacobian.T @ weighted @ jacobian
        gradient += jacobian.T @ weighted @ error
    np.testing.assert_allclose(equations.gradient, gradient, rtol=1e-9, atol=1e-9)
    equations.factorise(0.0)
    solution = equations.solve(-gradient)
    np.testing.assert_allclose(dense @ solution, -gradient, atol=1e-6)


def test_a_robust_loss_defeats_a_planted_wrong_edge():
    rng = np.random.default_rng(5)
    clean, _ = loop(rng, noise=0.01)
    clean.optimise()
    results = {}
    for kind in Loss:
        graph, _ = loop(np.random.default_rng(5), noise=0.01)
        wrong = graph.add_edge(3, 23, Pose2(0.1, 0.0, 0.2), INFORMATION, kind, 10.0)
        graph.optimise(200)
        results[kind] = np.abs(graph.poses[:, :2] - clean.poses[:, :2]).max()
        if kind is Loss.DCS:
            graph.remove_edge(wrong)
            graph.optimise()
            np.testing.assert_allclose(graph.poses, clean.poses, atol=1e-3)
    assert results[Loss.SQUARED] > 1.0
    assert results[Loss.DCS] < 0.05


def test_iterations_may_be_spread_and_the_graph_may_grow_between_them():
    whole, _ = loop(np.random.default_rng(6), noise=0.05)
    whole.optimise()
    step = PoseGraph()
    step.add_node(whole.pose(0))
    for k in range(1, len(whole.poses)):
        step.add_node(step.pose(k - 1) @ Pose2(*whole.measured[k - 1]))
        step.add_edge(k - 1, k, Pose2(*whole.measured[k - 1]), INFORMATION)
        step.iterate()
    for (i, j), z in list(zip(whole.ends, whole.measured, strict=True))[len(whole.poses) - 1 :]:
        step.add_edge(i, j, Pose2(*z), INFORMATION)
        step.iterate()
    while not step.iterate().converged:
        pass
    np.testing.assert_allclose(step.poses, whole.poses, atol=1e-4)


def test_a_lonely_node_stays():
    graph, _ = loop(np.random.default_rng(7), noise=0.05)
    lonely = graph.add_node(Pose2(9.0, 9.0, 1.0))
    graph.optimise()
    assert graph.pose(lonely) == Pose2(9.0, 9.0, 1.0)


def test_one_node_and_no_edges_is_already_optimal():
    graph = PoseGraph()
    graph.add_node(Pose2.identity())
    assert graph.optimise().converged


@pytest.mark.parametrize(
    ("ends", "information", "message"),
    [
        ((0, 2), np.eye(3), "0 to 1, got 0 and 2"),
        ((1, 1), np.eye(3), "got 1 and 1"),
        ((0, 1), np.full((3, 3), np.nan), "symmetric"),
        ((0, 1), np.triu(np.ones((3, 3))), "symmetric"),
    ],
)
def test_nonsense_edges_are_refused(ends: tuple[int, int], information: np.ndarray, message: str):
    graph = PoseGraph()
    graph.add_node(Pose2.identity())
    graph.add_node(Pose2(1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=message):
        graph.add_edge(*ends, Pose2.identity(), information)


def test_the_minimum_is_the_one_that_scipy_finds():
    graph, _ = loop(np.random.default_rng(8), noise=0.05)
    start, root = graph.poses.copy(), np.linalg.cholesky(INFORMATION).T

    def residuals(free: np.ndarray) -> np.ndarray:
        poses = np.vstack((start[:1], free.reshape(-1, 3)))
        out = np.empty((len(graph.ends), 3))
        for k, (i, j) in enumerate(graph.ends):
            kernels.edge_error(poses[i], poses[j], graph.measured[k], out[k])
        return (out @ root.T).ravel()

    expected = 2.0 * least_squares(residuals, start[1:].ravel(), xtol=1e-12, ftol=1e-12).cost
    assert graph.optimise().cost == pytest.approx(expected, rel=1e-4)
