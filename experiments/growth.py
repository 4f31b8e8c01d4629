"""A picture of a map growing, for a README.

python -m experiments.growth --out growth.png --building.kind office --building.seed 3
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.config import ExperimentConfig
from experiments.exit_status import MISTAKE, UNRECORDED

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.recorders import Recorder


@dataclass(frozen=True)
class Growth:
    """Explore a building and draw its map as it grew: a few panels (.png) or a loop (.gif)."""

    out: Path = Path("growth.png")
    """Where to put the picture; its suffix says which kind it is."""
    panels: int = 6
    """Of a .png, three in a row; the known area grows by equal steps from one to the next."""
    panel_width_px: int = 400
    """Its height follows the building's shape."""
    experiment: Annotated[ExperimentConfig, tyro.conf.arg(name="")] = field(default_factory=ExperimentConfig)

    def __post_init__(self) -> None:
        if self.panels < 1 or self.panel_width_px < 1:
            raise ValueError(f"a picture needs panels of pixels, got {self.panels} of {self.panel_width_px}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Explore and draw; the exit status is that of the exploration, 2 for a user's mistake."""
    said = tyro.cli(Growth, prog="python -m experiments.growth", args=arguments)
    try:
        return draw(said)
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE


def draw(said: Growth) -> int:
    """The exit status of the exploration; ValueError for a user's mistake, before it begins."""
    from experiments.experiment import prepare
    from experiments.recorders.growth_picture import GrowthPicture
    from experiments.run import run

    if not said.out.parent.is_dir():
        raise ValueError(f"no folder {said.out.parent} to put {said.out.name} in")
    experiment = prepare(said.experiment.pinned())

    def recorders(curve: ScoreCurve) -> list[Recorder]:
        return [GrowthPicture(said.out, experiment.setting, curve, said.panels, said.panel_width_px)]

    finished = run(experiment, recorders)
    for failure in finished.unrecorded:
        print(f"error: not drawn, {failure}", file=sys.stderr)
    return UNRECORDED if finished.unrecorded else finished.outcome.exit_status


if __name__ == "__main__":
    sys.exit(main())
