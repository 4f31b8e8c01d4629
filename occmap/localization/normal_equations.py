"""Sparse normal equations of a pose graph: where their 3 x 3 blocks are, and their factorisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from occmap.localization import pose_graph_kernels as kernels

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class BlockPattern:
    """Where the blocks of the upper triangle lie in CSC storage.

    A block column holds `blocks_above[c]` full blocks and then its diagonal one, of which each scalar
    column stores the part on and above the diagonal; its first value is at `column_start[c]`.
    `edge_block[k]` is the place of edge k's block within its block column, -1 if one end is fixed.
    """

    column_start: Ints  # (free nodes,)
    blocks_above: Ints  # (free nodes,)
    edge_block: Ints  # (m,)
    indptr: Ints
    indices: Ints
    diagonal: Ints  # (3 * free nodes,) where the scalar diagonal lies among the values


def block_pattern(slot: Ints, ends: Ints) -> BlockPattern:
    """The pattern of edges `ends` (m, 2) between nodes whose blocks are slot (n,), -1 when fixed."""
    n_free = int(np.count_nonzero(slot >= 0))
    low, high = np.sort(slot[ends], axis=1).T
    keys, place = np.unique(np.where(low >= 0, high * n_free + low, -1), return_inverse=True)
    n_fixed = int(keys.size > 0 and keys[0] < 0)
    columns, rows = np.divmod(keys[n_fixed:], max(n_free, 1))
    above = np.bincount(columns, minlength=n_free)
    first_block = np.concatenate(([0], np.cumsum(above)))
    edge_block = np.where(low >= 0, place.reshape(-1) - n_fixed - first_block[np.maximum(high, 0)], -1)

    values = 9 * above + 6
    ends_of_columns = np.cumsum(values)
    column_start = ends_of_columns - values
    indptr = np.empty(3 * n_free + 1, np.int64)
    indices = np.empty(int(values.sum()), np.int64)
    kernels.fill_indices(column_start, above, rows, indptr, indices)
    return BlockPattern(column_start, above, edge_block, indptr, indices, indptr[1:] - 1)


class NormalEquations:
    """H d = -g with a fill-reducing order found once and reused while the graph keeps its shape."""

    def __init__(self, pattern: BlockPattern) -> None:
        self.pattern = pattern
        self.hessian = np.zeros(len(pattern.indices))  # upper triangle, CSC values
        self.gradient = np.zeros(len(pattern.diagonal))
        n = len(self.gradient)
        self._matrix = csc_matrix((self.hessian.copy(), pattern.indices, pattern.indptr), shape=(n, n))
        self._factor: qdldl.Solver | None = None

    def factorise(self, damping: float) -> Floats:
        """Factorise H + damping * diag(H); returns that added diagonal.

        A node that no edge ties down has zeros there; it gets the bare damping and stays where it is.
        """
        diagonal = self.hessian[self.pattern.diagonal]
        added = np.where(diagonal > 0.0, damping * diagonal, damping)
        self._matrix.data[:] = self.hessian
        self._matrix.data[self.pattern.diagonal] += added
        if self._factor is None:
            self._factor = qdldl.Solver(self._matrix, upper=True)
        else:
            self._factor.update(self._matrix, upper=True)
        return added

    def solve(self, right: Floats) -> Floats:
        """(3 * free nodes,) solution of the system factorised last; RuntimeError if none was."""
        if self._factor is None:
            raise RuntimeError("factorise before solving")
        return self._factor.solve(right)
