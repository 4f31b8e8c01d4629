"""How an episode went over time: the samples behind every curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from occmap.decision import Status

if TYPE_CHECKING:
    from experiments.episode import Step
    from experiments.scoring import MapScore, Scorer

MILESTONES = (50, 90, 95, 99)
"""Per cent explored."""
PERIOD_S = 2.0
"""Between samples, in simulated time."""
PROMPT_CELLS = 1_500_000
"""A building of 60 m x 60 m at 5 cm."""


@dataclass(frozen=True)
class Sample:
    """The state of a run at one instant."""

    time_s: float
    path_length_m: float
    position_error_m: float
    """Between the true robot and its estimate, placed in the world by the true start alone."""
    frontiers: int
    score: MapScore


class ScoreCurve:
    """A recorder that scores the map every PERIOD_S of simulated time, and at the end.

    Scoring a whole map costs milliseconds, so it is not done at every scan; of one beyond PROMPT_CELLS it
    costs so much more that it is done as much less often. Recorders that show a score read `latest`; those
    that draw curves read `samples`.
    """

    def __init__(self, scorer: Scorer) -> None:
        self.samples: list[Sample] = []
        self._scorer = scorer
        self._period_s = PERIOD_S * max(1.0, scorer.truth.wall.size / PROMPT_CELLS)

    @property
    def latest(self) -> Sample:
        """The newest sample; there is one from the first step on."""
        return self.samples[-1]

    def record(self, step: Step) -> None:
        """Score this step if it is due or the explorer's last."""
        is_due = not self.samples or step.truth.time_s >= self.latest.time_s + self._period_s - 1e-9
        if is_due or step.decision.status is not Status.EXPLORING:
            self.sample(step)

    def sample(self, step: Step) -> None:
        """Score this step now, unless it has been."""
        if self.samples and self.latest.time_s == step.truth.time_s:
            return
        estimate = self._scorer.world_from_map @ step.decision.map_from_robot
        self.samples.append(
            Sample(
                time_s=step.truth.time_s,
                path_length_m=step.truth.path_length_m,
                position_error_m=estimate.distance_to(step.truth.world_from_robot),
                frontiers=len(step.decision.frontiers),
                score=self._scorer.score(step.grid),
            )
        )

    def close(self) -> None:
        """Nothing to finish: the samples stay."""


def milestone(samples: Sequence[Sample], explored: float) -> dict[str, float] | None:
    """Metres driven and seconds passed when this much was explored for the first time; None if never.

    Linear between the two samples around it.
    """
    for before, after in zip([samples[0], *samples], samples, strict=False):
        if after.score.explored < explored:
            continue
        rise = after.score.explored - before.score.explored
        share = (explored - before.score.explored) / rise if rise > 0.0 else 1.0
        share = max(0.0, share)
        return {
            "metres": before.path_length_m + share * (after.path_length_m - before.path_length_m),
            "seconds": before.time_s + share * (after.time_s - before.time_s),
        }
    return None
