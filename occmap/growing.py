"""A NumPy array that grows row by row, so that a graph can be handed to kernels without a copy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

FIRST_ROWS = 16
"""Room at first; it is doubled whenever it runs out."""


class GrowingArray:
    """Rows of one shape and dtype, appended in amortised constant time."""

    def __init__(self, row_shape: tuple[int, ...] = (), dtype: DTypeLike = np.float64) -> None:
        self._storage = np.zeros((FIRST_ROWS, *row_shape), dtype)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, row: ArrayLike) -> None:
        """Add a row of row_shape at the end; views of the rows so far may be void."""
        if self._count == len(self._storage):
            full = self._storage
            self._storage = np.zeros((2 * len(full), *full.shape[1:]), full.dtype)  # lazily: free until used
            self._storage[: len(full)] = full
        self._storage[self._count] = row
        self._count += 1

    @property
    def rows(self) -> NDArray:
        """(n, *row_shape) view of what was appended; writing to it writes to the array."""
        return self._storage[: self._count]
