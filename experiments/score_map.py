"""Scores the walls of a map against those of another: slam against the known pose, or either against truth.

python -m experiments.score_map runs/slam/map.yaml runs/known-pose/map.yaml
python -m experiments.score_map runs/office-0/map.yaml runs/office-0/truth.yaml
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.exit_status import MISTAKE

if TYPE_CHECKING:
    from experiments.map_agreement import MapAgreement
    from occmap.map_server import NavMap


@dataclass(frozen=True)
class Command:
    """Say how far the walls of one Nav2 map lie from those of another.

    Each is placed by the origin in its own YAML; nothing is aligned, so both must be in one frame, as
    all maps are that runs in one building leave.
    """

    judged: Annotated[Path, tyro.conf.Positional]
    """The map to judge, a map.yaml with a PGM."""
    reference: Annotated[Path, tyro.conf.Positional]
    """The map to judge it by. What it does not know is left out."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the scores; the exit status is 2 for a user's mistake."""
    command = tyro.cli(Command, prog="python -m experiments.score_map", args=arguments)
    from experiments.map_agreement import map_agreement

    try:
        agreement = map_agreement(map_at(command.judged), map_at(command.reference))
    except (OSError, ValueError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    for line in report(agreement):
        print(line)
    return 0


def map_at(path: Path) -> NavMap:
    """The map of a YAML. ValueError if it is none, with a hint if it is but the picture."""
    from occmap.map_server import load_map

    if path.suffix.lower() not in (".yaml", ".yml") and path.with_suffix(".yaml").is_file():
        raise ValueError(f"{path} does not say where it lies: give the {path.stem}.yaml beside it")
    return load_map(path)


def report(agreement: MapAgreement) -> Iterator[str]:
    """A line per figure."""
    yield f"{agreement.occupied} occupied cells, {agreement.seen} of them where the reference has been"
    if agreement.share is not None:
        yield f"{100.0 * agreement.share:.2f} % of those lie within one cell of one of its walls"
    if agreement.mean_m is not None:
        yield f"distance to its nearest: mean {agreement.mean_m:.4f} m, p95 {agreement.p95_m:.4f} m"


if __name__ == "__main__":
    sys.exit(main())
