"""What a goal is worth, strategy by strategy."""

from __future__ import annotations

import math
from typing import Literal

Strategy = Literal["nearest", "utility", "gain_per_cost", "gain_decay", "tour"]

NEAREST_M = 0.5
"""No goal counts as nearer than this when its gain is divided by its cost."""
DECAY_PER_M = 0.1
"""How fast a gain fades with the way to it."""


def utility(gain_m2: float, cost_m: float, lambda_m_per_m2: float) -> float:
    """lambda * gain - cost: what a look is worth, less the way there.

    Burgard et al., Coordinated multi-robot exploration, IEEE T-RO 21(3), 2005, weigh the cost instead:
    dividing by a weight leaves the order as it is.
    """
    return lambda_m_per_m2 * gain_m2 - cost_m


def gain_per_cost(gain_m2: float, cost_m: float) -> float:
    """Area that a look shows for each metre of the way there."""
    return gain_m2 / max(cost_m, NEAREST_M)


def gain_decay(gain_m2: float, cost_m: float) -> float:
    """gain * exp(-k cost): González-Baños and Latombe, Navigation strategies for exploring indoor
    environments, IJRR 21(10-11), 2002.
    """
    return gain_m2 * math.exp(-DECAY_PER_M * cost_m)


def is_by_cost_alone(strategy: Strategy) -> bool:
    """Whether no gain is asked for: the nearest is best (in a tour: of its first stop)."""
    return strategy in ("nearest", "tour")


def worth(strategy: Strategy, gain_m2: float, cost_m: float, lambda_m_per_m2: float) -> float:
    """The number that decides between goals: the more, the better. In metres, but for the last two."""
    if is_by_cost_alone(strategy):
        return -cost_m
    if strategy == "utility":
        return utility(gain_m2, cost_m, lambda_m_per_m2)
    return (gain_per_cost if strategy == "gain_per_cost" else gain_decay)(gain_m2, cost_m)
