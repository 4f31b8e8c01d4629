"""What a list of errors amounts to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Statistics:
    """In the errors' own unit; std is that of the population, as in evo."""

    mean: float
    std: float
    max: float
    median: float
    rmse: float

    @staticmethod
    def of(errors: NDArray[np.float64]) -> Statistics:
        if not len(errors):
            raise ValueError("no errors to sum up")
        return Statistics(
            mean=float(np.mean(errors)),
            std=float(np.std(errors)),
            max=float(np.max(errors)),
            median=float(np.median(errors)),
            rmse=float(np.sqrt(np.mean(errors**2))),
        )
