"""How good a map is, as defined in the README: the belief against the truth. The robot never sees this."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MapScore:
    """Ratios in [0, 1] and metres; see the README for the definitions."""

    explored: float
    known: float
    wrong: float
    wall_recall: float
    wall_error_mean_m: float
    """nan while no cell is believed occupied."""
    wall_error_p95_m: float
    explorable_area_m2: float
    wrong_cells: int
