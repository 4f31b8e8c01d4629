"""What a look at all of a large building has left, to be relied on for a while."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from occmap.frontiers import Frontier

TRUSTED_RUNS = 20
"""So many searches rely on it before all is looked at again."""


@dataclass
class Leftovers:
    """Frontiers without any goal, and edges that may be the mouths of nooks."""

    hopeless: dict[int, Frontier]  # by their ids, and kept, so that these stay theirs
    edges: list[Frontier]
    state: NDArray[np.uint8]  # the array they are cells of
    trust: int = TRUSTED_RUNS
