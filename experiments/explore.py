"""The main job: drop a robot into a building it has never seen and get a map of it.

python -m experiments.explore
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.command import Command, parse
from experiments.exit_status import CTRL_C, INTERRUPTED, MISTAKE, UNRECORDED
from experiments.signals import StopRequest
from experiments.words import counted, say

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.experiment import Experiment
    from experiments.recorders import Recorder
    from experiments.run import Run
    from experiments.run_folder import RunFolder
    from experiments.summary import Summary


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, prepare, explore, write.

    Returns the exit status: see `Outcome`; 1 if all went well but for a recording or a film, and 2 for a
    user's mistake.
    """
    with StopRequest() as stop:
        try:
            command = parse(sys.argv[1:] if arguments is None else arguments)
            say("preparing (a first run compiles kernels for some seconds)")
            experiment, folder = set_up(command)
        except (ValueError, OSError) as mistake:
            say(f"error: {mistake}")
            return MISTAKE
        except KeyboardInterrupt:  # asked twice: nothing is worth waiting for yet
            return CTRL_C
        return explore(experiment, folder, command, stop)


def set_up(command: Command) -> tuple[Experiment, RunFolder]:
    """Everything that can fail for a user's mistake."""
    from experiments.experiment import prepare
    from experiments.run_folder import RunFolder

    config = command.experiment.pinned()
    experiment = prepare(config)
    if command.out is not None:
        folder = RunFolder.create(command.out)
    else:
        folder = RunFolder.create_named(Path("runs"), f"{experiment.building.name}-{config.seed}")
    folder.write_config(config)
    return experiment, folder


def explore(experiment: Experiment, folder: RunFolder, command: Command, stop: StopRequest) -> int:
    """Run to the end, or until asked to stop, and write down what came of it."""
    from experiments.outcome import Outcome
    from experiments.run import run
    from experiments.summary import summarise

    finished = run(experiment, recorders_of(experiment, folder, command), stop)
    summary = summarise(finished)
    folder.write_results(finished, summary)
    say(report(summary, finished, folder))
    if finished.outcome is Outcome.INTERRUPTED and stop.signal is not None:
        return INTERRUPTED + stop.signal
    return finished.outcome.exit_status or (UNRECORDED if finished.unrecorded else 0)


def recorders_of(
    experiment: Experiment, folder: RunFolder, command: Command
) -> Callable[[ScoreCurve], list[Recorder]]:
    """Those that the command asks for, to be made when the run begins."""
    from experiments import run_folder
    from experiments.progress import ProgressBar
    from experiments.recorders.coverage_plot import CoveragePlot

    def recorders(curve: ScoreCurve) -> list[Recorder]:
        watchers: list[Recorder] = [ProgressBar(curve)]
        watchers.append(CoveragePlot(folder / run_folder.PLOT, curve, experiment.building.name))
        if command.record:
            from experiments.recorders.rerun_recorder import RerunRecorder

            path = folder / run_folder.RECORDING
            watchers.append(RerunRecorder(path, experiment.setting, curve, experiment.scorer.truth))
        if command.video:
            from experiments.recorders.video_recorder import VideoRecorder

            watchers.append(VideoRecorder(folder / run_folder.VIDEO, experiment.setting, curve))
        return watchers

    return recorders


def report(summary: Summary, finished: Run, folder: RunFolder) -> str:
    """The figures that people look at first."""
    minutes = summary.sim_time_s / 60.0
    lines = [
        f"{summary.status}: {summary.explored:.2%} explored of {summary.explorable_area_m2:.0f} m²",
        f"{summary.path_length_m:.0f} m driven in {minutes:.1f} min, "
        f"{summary.real_time_factor:.0f} times faster than real time",
        f"wrong {summary.wrong:.3%}, wall recall {summary.wall_recall:.2%}, "
        f"{wall_error(summary.wall_error_m['mean'])}, "
        f"{counted(round(summary.collisions['events']), 'collision')}",
    ]
    if summary.competitive_ratio is not None:
        lines.append(f"{summary.competitive_ratio:.2f} times as far as somebody who knows the building must")
    if not summary.honest:
        lines.append("the robot's last word does not agree with the truth: see `honest` in the summary")
    if finished.fault:
        lines.append(f"error: {finished.fault}")
    lines += [f"error: not written, {failure}" for failure in finished.unrecorded]
    lines.append(f"results in {folder.path}")
    return "\n".join(lines)


def wall_error(mean_m: float) -> str:
    """How far off the map's walls are; nan if it has none."""
    return "no wall in the map" if math.isnan(mean_m) else f"wall error {100.0 * mean_m:.1f} cm"


if __name__ == "__main__":
    sys.exit(main())
