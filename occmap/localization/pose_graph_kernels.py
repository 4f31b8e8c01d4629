"""Kernels of the pose graph: errors, Jacobians and normal equations of SE(2) edges.

An edge (i, j) measures z = i_from_j. Its error is that of g2o's EDGE_SE2,

    e = z^-1 @ (map_from_i^-1 @ map_from_j)  as (x, y, yaw),

and a node moves by a step d = (dx, dy, dyaw) taken in its own frame, so that both Jacobians depend
on relative poses alone (Grisetti et al., "A tutorial on graph-based SLAM", 2010, section IV).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from occmap.kernel import kernel, part

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
DIAGONAL = np.int64(-1)
"""For a block: the diagonal one. Typed: a literal would have `_add_block` compiled once more."""


@kernel
def edge_error(pose_i: Floats, pose_j: Floats, z: Floats, error: Floats) -> None:
    """Fill error (3,) of one edge from two poses and a measurement, each (x, y, yaw)."""
    ci, si = math.cos(pose_i[2]), math.sin(pose_i[2])
    cz, sz = math.cos(z[2]), math.sin(z[2])
    dx, dy = pose_j[0] - pose_i[0], pose_j[1] - pose_i[1]
    x = ci * dx + si * dy - z[0]
    y = -si * dx + ci * dy - z[1]
    error[0] = cz * x + sz * y
    error[1] = -sz * x + cz * y
    error[2] = math.pi - (math.pi - (pose_j[2] - pose_i[2] - z[2])) % (2.0 * math.pi)


@part
def edge_jacobians(pose_i: Floats, pose_j: Floats, z: Floats, by_i: Floats, by_j: Floats) -> None:
    """Fill d(error)/d(step of i) and d(error)/d(step of j), both (3, 3)."""
    ci, si = math.cos(pose_i[2]), math.sin(pose_i[2])
    cz, sz = math.cos(z[2]), math.sin(z[2])
    dx, dy = pose_j[0] - pose_i[0], pose_j[1] - pose_i[1]
    x, y = ci * dx + si * dy, -si * dx + ci * dy  # j seen from i
    turn = pose_j[2] - pose_i[2] - z[2]
    ct, st = math.cos(turn), math.sin(turn)
    by_i[:] = 0.0
    by_i[0, 0], by_i[0, 1], by_i[0, 2] = -cz, -sz, cz * y - sz * x
    by_i[1, 0], by_i[1, 1], by_i[1, 2] = sz, -cz, -sz * y - cz * x
    by_i[2, 2] = -1.0
    by_j[:] = 0.0
    by_j[0, 0], by_j[0, 1] = ct, -st
    by_j[1, 0], by_j[1, 1] = st, ct
    by_j[2, 2] = 1.0


@kernel
def robust_cost_and_weight(chi2: float, loss: int, scale: float) -> tuple[float, float]:
    """(rho(chi2), its derivative) of a loss numbered as in pose_graph.Loss; see there for the sources."""
    if loss == 0 or chi2 <= scale:
        return chi2, 1.0
    switch = 2.0 * scale / (scale + chi2)
    return scale * (3.0 * chi2 - scale) / (scale + chi2), switch * switch


@kernel
def edge_losses(
    poses: Floats,
    ends: Ints,
    z: Floats,
    information: Floats,
    loss: Ints,
    scale: Floats,
    chi2: Floats,
    weights: Floats,
) -> float:
    """Fill chi2 (m,) = e^T information e and weights (m,) = rho'(chi2) of all edges.

    Returns the sum of rho(chi2). O(m).
    """
    e = np.empty(3)
    cost = 0.0
    for k in range(len(ends)):
        edge_error(poses[ends[k, 0]], poses[ends[k, 1]], z[k], e)
        total = 0.0
        for a in range(3):
            for b in range(3):
                total += e[a] * information[k, a, b] * e[b]
        rho, weights[k] = robust_cost_and_weight(total, loss[k], scale[k])
        chi2[k] = total
        cost += rho
    return cost


@kernel
def linearise(
    poses: Floats,
    ends: Ints,
    z: Floats,
    information: Floats,
    loss: Ints,
    scale: Floats,
    slot: Ints,
    column_start: Ints,
    blocks_above: Ints,
    edge_block: Ints,
    hessian: Floats,
    gradient: Floats,
) -> float:
    """Fill the upper triangle of H = J^T W J (CSC values) and g = J^T W e; return the robust cost. O(m).

    slot[node] is a node's block in H, -1 when fixed. The other index arrays are BlockPattern's.
    """
    hessian[:] = 0.0
    gradient[:] = 0.0
    e, by_i, by_j = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    cost = 0.0
    for k in range(len(ends)):
        i, j = ends[k, 0], ends[k, 1]
        edge_error(poses[i], poses[j], z[k], e)
        edge_jacobians(poses[i], poses[j], z[k], by_i, by_j)
        chi2 = 0.0
        for a in range(3):
            for b in range(3):
                chi2 += e[a] * information[k, a, b] * e[b]
        rho, weight = robust_cost_and_weight(chi2, loss[k], scale[k])
        cost += rho
        row, column = int(slot[i]), int(slot[j])
        if row >= 0:
            _add_block(by_i, by_i, information[k], weight, column_start, blocks_above, row, DIAGONAL, hessian)
            _add_gradient(by_i, information[k], weight, e, row, gradient)
        if column >= 0:
            _add_block(
                by_j, by_j, information[k], weight, column_start, blocks_above, column, DIAGONAL, hessian
            )
            _add_gradient(by_j, information[k], weight, e, column, gradient)
        if row >= 0 and column >= 0:
            left, right = (by_i, by_j) if row < column else (by_j, by_i)
            last, block = max(row, column), int(edge_block[k])
            _add_block(left, right, information[k], weight, column_start, blocks_above, last, block, hessian)
    return cost


@kernel
def _add_block(
    left: Floats,
    right: Floats,
    information: Floats,
    weight: float,
    column_start: Ints,
    blocks_above: Ints,
    column: int,
    block: int | np.int64,
    hessian: Floats,
) -> None:
    """Add weight * left^T information right to one block of a block column."""
    above = blocks_above[column]
    diagonal = block < 0
    first = 3 * (above if diagonal else block)
    for c in range(3):
        start = column_start[column] + 3 * above * c + c * (c + 1) // 2 + first
        for r in range(c + 1 if diagonal else 3):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += left[a, r] * information[a, b] * right[b, c]
            hessian[start + r] += weight * total


@kernel
def _add_gradient(
    by: Floats, information: Floats, weight: float, e: Floats, block: int, gradient: Floats
) -> None:
    """Add weight * by^T information e to one block of the gradient."""
    for r in range(3):
        total = 0.0
        for a in range(3):
            for b in range(3):
                total += by[a, r] * information[a, b] * e[b]
        gradient[3 * block + r] += weight * total


@kernel
def fill_indices(column_start: Ints, blocks_above: Ints, rows: Ints, indptr: Ints, indices: Ints) -> None:
    """Scalar CSC indices of the upper triangle; rows lists the blocks above each diagonal one, ascending."""
    next_block = 0
    for column in range(len(blocks_above)):
        above = blocks_above[column]
        for c in range(3):
            start = column_start[column] + 3 * above * c + c * (c + 1) // 2
            indptr[3 * column + c] = start
            for block in range(above):
                for r in range(3):
                    indices[start + 3 * block + r] = 3 * rows[next_block + block] + r
            for r in range(c + 1):
                indices[start + 3 * above + r] = 3 * column + r
        next_block += above
    indptr[-1] = len(indices)


@kernel
def retract(poses: Floats, slot: Ints, step: Floats, moved: Floats) -> None:
    """Fill moved (n, 3) with the poses after a step (3 * free nodes,), each taken in its node's own frame."""
    for node in range(len(poses)):
        x, y, yaw = poses[node, 0], poses[node, 1], poses[node, 2]
        if slot[node] >= 0:
            dx, dy, turn = step[3 * slot[node]], step[3 * slot[node] + 1], step[3 * slot[node] + 2]
            c, s = math.cos(yaw), math.sin(yaw)
            x += c * dx - s * dy
            y += s * dx + c * dy
            yaw = math.pi - (math.pi - (yaw + turn)) % (2.0 * math.pi)
        moved[node, 0], moved[node, 1], moved[node, 2] = x, y, yaw
