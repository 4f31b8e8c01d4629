"""A run beside its oracle, as three figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from experiments.boundary_cells import cells_within
from experiments.oracle.floor import Floor
from experiments.oracle.tour import ENOUGH, Oracle, metres, near_shortest_tour, seen_along
from occmap.geometry import Points

if TYPE_CHECKING:
    from experiments.run import Run

LEAST_M = 0.1
"""Where an oracle need not drive there is no ratio."""


@dataclass(frozen=True)
class OracleFigures:
    """What `summary.json` says of an oracle. All None where not even the oracle sees enough."""

    oracle_m: float | None
    oracle_lower_bound_m: float | None
    competitive_ratio: float | None
    """Metres driven / oracle_m; None for a run that saw too little, and where nobody need drive."""


def compared(oracle: Oracle, floor: Floor, trail: Points) -> OracleFigures:
    """A trail (n, 2), in `world`, beside an oracle on the same floor."""
    if oracle.seen < ENOUGH:
        return OracleFigures(None, None, None)
    is_fair = oracle.length_m >= LEAST_M and seen_along(floor, trail) >= ENOUGH
    return OracleFigures(
        oracle.length_m, oracle.lower_bound_m, metres(trail) / oracle.length_m if is_fair else None
    )


def oracle_of(run: Run) -> OracleFigures:
    """The oracle of a run that has just ended, in the building as it was at the start."""
    experiment = run.experiment
    scorer, world = experiment.scorer, experiment.robot.world
    floor = Floor(
        scorer.truth,
        scorer.explorable,
        experiment.world_from_map,
        world.body_radius_m,
        experiment.config.lidar.max_range_m,
        cells_within(experiment.config.boundary, scorer.truth),
    )
    trail = run.trajectory.true[:, :2]
    return compared(near_shortest_tour(floor, [trail]), floor, trail)
