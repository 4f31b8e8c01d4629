"""Scores a trajectory against a benchmark's relations, or against a reference trajectory.

python -m experiments.score_trajectory laser.tum --relations intel.relations
python -m experiments.score_trajectory trajectory.tum --reference truth.tum
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from experiments.exit_status import MISTAKE

if TYPE_CHECKING:
    from experiments.error_statistics import Statistics
    from experiments.relations import RelationsScore
    from experiments.tum_file import Trajectory


@dataclass(frozen=True)
class Command:
    """Score a trajectory file against relations (Kümmerle et al. 2009), a reference trajectory, or both."""

    trajectory: Annotated[Path, tyro.conf.Positional]
    """The estimate, a TUM file. Relations are between the laser's poses: score laser.tum, not the robot's."""
    relations: Path | None = None
    """Lines `t1 t2 x y z roll pitch yaw` of true relations."""
    reference: Path | None = None
    """The true trajectory, a TUM file: gives ATE and RPE as evo defines them."""
    align: bool = False
    """Move the estimate rigidly onto the reference before the ATE, as `evo_ape --align` does."""
    rpe_delta: float = 1.0
    """How far apart the poses are whose motion the RPE compares."""
    rpe_unit: Literal["frames", "m"] = "frames"
    """Of rpe_delta."""

    def __post_init__(self) -> None:
        if self.relations is None and self.reference is None:
            raise ValueError("nothing to score against: give --relations FILE or --reference FILE")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the scores; the exit status is 2 for a user's mistake."""
    try:
        command = tyro.cli(Command, prog="python -m experiments.score_trajectory", args=arguments)
        for line in report(command):
            print(line)
    except ValueError as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    return 0


def report(command: Command) -> Iterator[str]:
    """A line per figure."""
    from experiments.relations import read_relations, score_relations
    from experiments.tum_file import read_tum

    estimate = read_tum(command.trajectory)
    if command.relations is not None:
        yield from relations_lines(score_relations(estimate, read_relations(command.relations)))
    if command.reference is not None:
        yield from _reference_lines(read_tum(command.reference), estimate, command)


def relations_lines(score: RelationsScore) -> Iterator[str]:
    """What the benchmark's tables hold: mean ± std and max of each error."""
    missing = f", {score.missing} more have no pose" if score.missing else ""
    yield f"{score.relations} relations{missing}"
    yield f"translation  {_spread(score.translation_m, 'm')}"
    yield f"  squared    {_spread(score.translation_squared_m2, 'm²')}"
    yield f"rotation     {_spread(score.rotation_deg, 'deg')}"
    yield f"  squared    {_spread(score.rotation_squared_deg2, 'deg²')}"


def _reference_lines(reference: Trajectory, estimate: Trajectory, command: Command) -> Iterator[str]:
    from experiments.trajectory_errors import absolute, relative

    ate = absolute(reference, estimate, command.align)
    metres, degrees = relative(reference, estimate, command.rpe_delta, command.rpe_unit)
    yield f"ATE{' aligned' if command.align else ''}  rmse {ate.rmse:.6f} m, {_spread(ate, 'm')}"
    distance = f"{command.rpe_delta:g} {command.rpe_unit}"
    yield f"RPE over {distance}  rmse {metres.rmse:.6f} m, {_spread(metres, 'm')}"
    yield f"RPE over {distance}  rmse {degrees.rmse:.6f} deg, {_spread(degrees, 'deg')}"


def _spread(errors: Statistics, unit: str) -> str:
    return f"{errors.mean:.4f} ± {errors.std:.4f} {unit}, max {errors.max:.4f} {unit}"


if __name__ == "__main__":
    sys.exit(main())
