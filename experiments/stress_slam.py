"""How well recorded logs are mapped that have been made harder: shorter sight, lost scans, no odometry, ...

python -m experiments.stress_slam intel.clf.bz2 fr079.clf.bz2
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.exit_status import MISTAKE

if TYPE_CHECKING:
    from experiments.logs.log import RecordedLog
    from occmap.geometry import Pose2
    from occmap.localization.slam import SlamLocalizer


WRONG_M, WRONG_RAD = 0.5, 0.1
"""A loop farther off than this joins what does not belong together."""
COLUMNS = ("log", "made harder", "scans", "translation, m", "rotation, deg", "loops", "wrong loops")


@dataclass(frozen=True)
class Command:
    """Map each log with the defaults, as it is and made harder in many ways, and print a table.

    Loops are judged by the trajectory of the log as it is, which the relations judge.
    """

    logs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Each with its relations beside it (NAME.relations for NAME.clf.bz2)."""
    only: tuple[str, ...] = ()
    """Just these ways, by name."""

    def __post_init__(self) -> None:
        from experiments.logs.perturbations import PERTURBATIONS

        unknown = [name for name in self.only if name not in PERTURBATIONS]
        if unknown:
            raise ValueError(f"unknown {', '.join(unknown)}: choose from {', '.join(PERTURBATIONS)}")
        if not self.logs:
            raise ValueError("name at least one log")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table as it comes; the exit status is 2 for a user's mistake."""
    from experiments.benchmark_slam import header

    try:
        command = tyro.cli(Command, prog="python -m experiments.stress_slam", args=arguments)
        print(header(COLUMNS), flush=True)
        for path in command.logs:
            for line in rows(path, command.only):
                print(line, flush=True)
    except (ValueError, OSError) as mistake:
        print(f"error: {mistake}", file=sys.stderr)
        return MISTAKE
    return 0


def rows(path: Path, only: Sequence[str] = ()) -> Iterator[str]:
    """A line for each way to make one log harder."""
    from experiments.benchmark_slam import error_cells, row
    from experiments.logs.log import read_log
    from experiments.logs.perturbations import PERTURBATIONS
    from experiments.relations import relations_beside, score_relations
    from experiments.tum_file import Trajectory

    name = path.name.split(".")[0]
    log, relations = read_log(path), relations_beside(path)
    truth = dict(mapped(log)[0].trajectory())
    for way in only or PERTURBATIONS:
        harder = PERTURBATIONS[way](log)
        slam, began_s = mapped(harder)
        mounts = [seen.robot_from_lidar for seen in harder.observations]
        times_s, poses = zip(*slam.trajectory(), strict=True)
        lasers = [pose @ mount for pose, mount in zip(poses, mounts, strict=True)]
        laser = Trajectory.of(list(times_s), lasers)
        score = None if relations is None else score_relations(laser, relations)
        wrong = wrong_loops(slam, [truth[time_s] for time_s in began_s])
        yield row((name, way, len(times_s), *error_cells(score), len(slam.loops.believed), wrong))


def mapped(log: RecordedLog) -> tuple[SlamLocalizer, list[float]]:
    """What slam made of a log, and the stamps at which its submaps began."""
    from experiments.replaying.runner import live
    from occmap.localization.slam import SlamLocalizer
    from occmap.stopwatch import Stopwatch

    slam, began_s = SlamLocalizer(), []
    for step in live(log.observations, slam, Stopwatch()):
        began_s += [step.observation.time_s] * (len(slam.tracker.submaps) - len(began_s))
    slam.finish()
    return slam, began_s


def wrong_loops(slam: SlamLocalizer, map_from_submap: Sequence[Pose2]) -> int:
    """How many of the loops believed are far from the true poses of the submaps that they join."""
    wrong = 0
    for loop in slam.loops.believed:
        true = map_from_submap[loop.older].inverse() @ map_from_submap[loop.younger]
        error = true.inverse() @ loop.older_from_younger
        wrong += math.hypot(error.x_m, error.y_m) > WRONG_M or abs(error.yaw_rad) > WRONG_RAD
    return wrong


if __name__ == "__main__":
    sys.exit(main())
