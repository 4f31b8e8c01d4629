"""A pose graph on SE(2) and its Levenberg-Marquardt optimiser."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from occmap.config_checks import Positive
from occmap.geometry import Pose2
from occmap.growing import GrowingArray

if TYPE_CHECKING:
    from occmap.localization.normal_equations import NormalEquations

Floats = NDArray[np.float64]

LEAST_DAMPING = 1e-3
"""Of the initial damping: what is less makes no difference, and would take long to grow again."""
NO_GAIN = 1e-3
"""A predicted gain of less than this part of the tolerance is rounding."""
ASYMMETRY = 1e-6
"""Relative; what an inverted covariance may have."""


class Loss(IntEnum):
    """Cost of an edge's disagreement, as a function of its chi2; all agree well below `loss_scale`."""

    SQUARED = 0
    """chi2 itself: an edge that is surely right."""
    DCS = 1
    """Saturates: dynamic covariance scaling (Agarwal et al. 2013), for edges that may be plain wrong."""


@dataclass(frozen=True)
class PoseGraphConfig(Positive):
    """When to stop, and how carefully to step."""

    relative_tolerance: float = 1e-6
    """Converged when an accepted step lowers the cost by less than this part of it."""
    initial_damping: float = 1e-6
    """Of Levenberg-Marquardt, relative to the diagonal; small: the first step is nearly Gauss-Newton's."""
    max_damping: float = 1e8
    """No step is worth taking when even this one does not lower the cost."""
    easing: float = 0.5
    """Graduated losses are lenient after an edge was added that the poses disagree with, and less so by this
    factor with every iteration (graduated non-convexity, Yang et al. 2020): who is wrong shows in the end."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.easing < 1.0:
            raise ValueError(f"easing must be less than 1, got {self.easing}")


@dataclass(frozen=True, slots=True)
class Iteration:
    """What one iteration of the optimiser did."""

    cost_before: float
    cost: float
    accepted: bool
    converged: bool


class PoseGraph:
    """Nodes map_from_node, edges i_from_j, and the most likely poses given them.

    Least squares of each edge's error, what it measured against what the poses say (x, y in metres, yaw in
    radians), weighted by its information: Grisetti et al., A tutorial on graph-based SLAM, 2010. The first
    node stays where it was put: that fixes the gauge. Nodes and edges may be added at any time, also between
    two calls of `iterate`; the poses so far are where the next iteration starts.
    """

    def __init__(self, config: PoseGraphConfig | None = None) -> None:
        self.config = config or PoseGraphConfig()
        self._poses = GrowingArray((3,))
        self._ends = GrowingArray((2,), np.int64)
        self._measured = GrowingArray((3,))
        self._information = GrowingArray((3, 3))
        self._loss = GrowingArray(dtype=np.int64)
        self._scale = GrowingArray()
        self._is_graduated = GrowingArray(dtype=np.bool_)
        self._ease = 1.0  # what the scales of graduated losses are multiplied by for now
        self._equations: NormalEquations | None = None
        self._slot = np.empty(0, np.int64)
        self._forget_damping()

    def add_node(self, map_from_node: Pose2) -> int:
        """Add a node; returns its number. The first one never moves."""
        self._poses.append((map_from_node.x_m, map_from_node.y_m, map_from_node.yaw_rad))
        self._equations = None
        return len(self._poses) - 1

    def add_edge(
        self,
        i: int,
        j: int,
        i_from_j: Pose2,
        information: Floats,
        loss: Loss = Loss.SQUARED,
        loss_scale: float = 1.0,
        is_graduated: bool = False,
    ) -> int:
        """Add an edge, the pose of j measured from i; returns its number.

        information: (3, 3) inverse covariance of x, y (1/m^2) and yaw (1/rad^2) in j's frame, symmetric.
        loss_scale: the chi2 from which a robust loss takes weight away. A graduated edge that disagrees with
        the poses is given a chance to convince the others. ValueError if the two are no nodes or the same,
        or a number is nonsense.
        """
        information = np.asarray(information, np.float64)
        if not (0 <= i < len(self._poses) and 0 <= j < len(self._poses)) or i == j:
            raise ValueError(f"an edge joins two of the nodes 0 to {len(self._poses) - 1}, got {i} and {j}")
        if information.shape != (3, 3) or not _is_finite_and_symmetric(information):
            raise ValueError(f"information must be a symmetric (3, 3) matrix, got {information.tolist()}")
        if not loss_scale > 0.0:
            raise ValueError(f"loss_scale must be positive, got {loss_scale}")
        self._ends.append((i, j))
        self._measured.append((i_from_j.x_m, i_from_j.y_m, i_from_j.yaw_rad))
        self._information.append(information)
        self._loss.append(int(loss))
        self._scale.append(loss_scale)
        self._equations = None
        self._forget_damping()
        self._is_graduated.append(is_graduated)
        if is_graduated:
            self._ease = max(self._ease, float(self.chi2()[-1]) / loss_scale)
        return len(self._ends) - 1

    def remove_edge(self, edge: int) -> None:
        """Take an edge's weight away; the numbers of the others stay."""
        self._information.rows[edge] = 0.0
        self._forget_damping()

    @property
    def poses(self) -> Floats:
        """(n, 3) view of x, y (m) and yaw (rad) of every node in the map."""
        return self._poses.rows

    @property
    def ends(self) -> NDArray[np.int64]:
        """(m, 2) view of the nodes that every edge joins."""
        return self._ends.rows

    @property
    def measured(self) -> Floats:
        """(m, 3) view of what every edge measured: x, y (m) and yaw (rad) of i_from_j."""
        return self._measured.rows

    @property
    def information(self) -> Floats:
        """(m, 3, 3) view of every edge's information."""
        return self._information.rows

    def pose(self, node: int) -> Pose2:
        """map_from_node of a node as it stands now."""
        x, y, yaw = self._poses.rows[node].tolist()
        return Pose2(x, y, yaw)

    def chi2(self) -> Floats:
        """(m,) e^T information e of every edge, before any loss."""
        return self._losses(self._scale.rows)[1]

    def weights(self) -> Floats:
        """(m,) what its loss leaves of every edge: 1 where it agrees, towards 0 where it must be wrong."""
        return self._losses(self._scale.rows)[2]

    def cost(self) -> float:
        """The cost that is minimised: the sum of every edge's loss."""
        return self._losses(self._scale_for_now())[0]

    def _losses(self, scale: Floats) -> tuple[float, Floats, Floats]:
        """The cost, and every edge's chi2 (m,) and weight (m,), with a scale (m,) of each loss."""
        from occmap.localization import pose_graph_kernels as kernels

        chi2, weights = np.empty(len(self._ends)), np.empty(len(self._ends))
        edges = self.ends, self.measured, self.information, self._loss.rows
        return kernels.edge_losses(self.poses, *edges, scale, chi2, weights), chi2, weights

    def optimise(self, max_iterations: int = 50) -> Iteration:
        """Iterate until converged, at most so often; returns the last iteration, with the cost before the
        first one. ValueError if that is less than once.
        """
        if max_iterations < 1:
            raise ValueError(f"max_iterations must be at least 1, got {max_iterations}")
        last = first = self.iterate()
        for _ in range(max_iterations - 1):
            if last.converged:
                break
            last = self.iterate()
        return Iteration(first.cost_before, last.cost, last.accepted, last.converged)

    def iterate(self) -> Iteration:
        """One step of Levenberg-Marquardt (Nielsen's damping, Madsen et al. 2004, section 3.2).

        It costs one linearisation and one factorisation, about a millisecond per thousand nodes, so that
        a robot can spread an optimisation over its turns.
        """
        from occmap.localization import pose_graph_kernels as kernels

        is_lenient, self._ease = self._ease > 1.0, max(1.0, self.config.easing * self._ease)
        cost = self._linearise()
        equations = self._system()
        if equations.gradient.size == 0:
            return Iteration(cost, cost, accepted=False, converged=True)
        added = equations.factorise(self._damping)
        step = equations.solve(-equations.gradient)
        before = self.poses.copy()
        kernels.retract(before, self._slot, step, self.poses)
        new_cost = self.cost()
        predicted = float(step @ (added * step - equations.gradient))
        tolerance = self.config.relative_tolerance
        if new_cost <= cost:
            gain = (cost - new_cost) / predicted if predicted > 0.0 else 0.0
            self._damping *= max(1.0 / 3.0, 1.0 - (2.0 * min(gain, 1.0) - 1.0) ** 3)
            self._damping = max(self._damping, LEAST_DAMPING * self.config.initial_damping)
            self._damping_growth = 2.0
            is_done = not is_lenient and cost - new_cost <= tolerance * cost
            return Iteration(cost, new_cost, accepted=True, converged=is_done)
        self.poses[:] = before
        self._damping *= self._damping_growth
        self._damping_growth *= 2.0
        hopeless = self._damping > self.config.max_damping or predicted <= NO_GAIN * tolerance * cost
        return Iteration(cost, cost, accepted=False, converged=hopeless and not is_lenient)

    def _scale_for_now(self) -> Floats:
        return np.where(self._is_graduated.rows, self._ease, 1.0) * self._scale.rows

    def _forget_damping(self) -> None:
        self._damping, self._damping_growth = self.config.initial_damping, 2.0

    def _system(self) -> NormalEquations:
        """The normal equations of the graph as it is shaped now."""
        from occmap.localization.normal_equations import NormalEquations, block_pattern

        if self._equations is None:
            self._slot = np.arange(len(self._poses)) - 1
            self._equations = NormalEquations(block_pattern(self._slot, self.ends))
        return self._equations

    def _linearise(self) -> float:
        """Fill the normal equations at the present poses; returns the cost."""
        from occmap.localization import pose_graph_kernels as kernels

        equations = self._system()
        pattern = equations.pattern
        return kernels.linearise(
            self.poses,
            self.ends,
            self.measured,
            self.information,
            self._loss.rows,
            self._scale_for_now(),
            self._slot,
            pattern.column_start,
            pattern.blocks_above,
            pattern.edge_block,
            equations.hessian,
            equations.gradient,
        )


def _is_finite_and_symmetric(matrix: Floats) -> bool:
    return bool(np.all(np.isfinite(matrix)) and np.allclose(matrix, matrix.T, rtol=ASYMMETRY))
