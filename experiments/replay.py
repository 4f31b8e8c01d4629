"""Maps a log that a real robot recorded.

python -m experiments.replay intel.clf.bz2 --relations intel.relations
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments.exit_status import CTRL_C, INTERRUPTED, LOST, MISTAKE
from experiments.replaying.localizers import ReplayLocalizer, make_localizer
from experiments.replaying.runner import ReplayConfig, Replayed, ReplayRecorder, replay
from experiments.replaying.states import StateOptions, make_from_state
from experiments.signals import StopRequest
from experiments.words import counted, say

if TYPE_CHECKING:
    from experiments.logs.log import RecordedLog
    from experiments.relations import Relations
    from experiments.replaying.whereabouts import Whereabouts
    from experiments.run_folder import RunFolder


@dataclass(frozen=True)
class Command:
    """Map a recorded log: CARMEN text (also .bz2, .gz), a ROS 2 bag, or an MCAP file.

    Leaves a folder in runs/ with the recording, the map (map.yaml, map.pgm), trajectory.tum (the
    robot), laser.tum (the laser) and summary.json. Exit status: 0 done, 2 a mistake in the options or
    the log, 6 with --localize-in if the robot is lost at the end, 130 or 143 interrupted.
    """

    log: Annotated[Path, tyro.conf.Positional]
    """The log: a file, or the folder of a ROS 2 bag."""
    relations: Path | None = None
    """Score the laser's trajectory against these true relations (Kümmerle et al. 2009)."""
    out: Path | None = None
    """The run's folder. By default a new one, runs/<log>. A folder that holds a run is refused."""
    record: bool = True
    """Write recording.rrd, to scrub through with `rerun`."""
    scan_topic: str | None = None
    """Of a bag: which LaserScan to map. By default the first by name."""
    odometry_topic: str | None = None
    """Of a bag: which Odometry to trust. By default the first by name, or the transforms if there is none."""
    replay: Annotated[ReplayConfig, tyro.conf.arg(name="")] = field(default_factory=ReplayConfig)
    state: Annotated[StateOptions, tyro.conf.arg(name="")] = field(default_factory=StateOptions)

    def __post_init__(self) -> None:
        if self.replay.pose != "slam" and (self.state.reads_a_state or self.state.save_state is not None):
            raise ValueError("only --pose slam has a state to save and to go on from")


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, read, replay, write. Returns the exit status."""
    try:
        command = tyro.cli(Command, prog="python -m experiments.replay", args=arguments)
        say(f"reading {command.log}")
        log, relations, localizer, folder = set_up(command)
    except (ValueError, OSError) as mistake:
        say(f"error: {mistake}")
        return MISTAKE
    except KeyboardInterrupt:
        return CTRL_C
    say(facts(log) + "\npreparing (a first run compiles kernels for some seconds)")
    whereabouts = whereabouts_in(localizer)
    with StopRequest() as stop:
        watchers = recorders_of(command, log, folder) + ([whereabouts] if whereabouts else [])
        replayed = replay(log, command.replay, watchers, stop, localizer, command.state.save_state)
        say(write(replayed, relations, whereabouts, folder, command))
    if stop.signal is not None:
        return INTERRUPTED + stop.signal
    return LOST if whereabouts is not None and whereabouts.is_lost else 0


def set_up(command: Command) -> tuple[RecordedLog, Relations | None, ReplayLocalizer, RunFolder]:
    """Everything that can fail for a user's mistake."""
    from experiments.logs.log import read_log
    from experiments.relations import read_relations
    from experiments.run_folder import RunFolder

    relations = None if command.relations is None else read_relations(command.relations)
    log = read_log(command.log, command.scan_topic, command.odometry_topic)
    config = command.replay
    localizer = (
        make_from_state(command.state, log.observations[0], config.map)
        if command.state.reads_a_state
        else make_localizer(config.pose, config.map)
    )
    if command.out is not None:
        return log, relations, localizer, RunFolder.create(command.out)
    return log, relations, localizer, RunFolder.create_named(Path("runs"), command.log.name.split(".")[0])


def facts(log: RecordedLog) -> str:
    """What was read, and what could not be."""
    minutes = log.duration_s / 60.0
    lines = [f"{counted(len(log.observations), 'scan')} of {minutes:.1f} min"]
    if not log.has_odometry:
        lines.append("the log has no odometry: every step is found by its scans alone")
    if log.skipped:
        lines.append(f"{len(log.skipped)} broken, passed over:")
        lines += [f"  {skipped.number}: {skipped.reason}" for skipped in log.skipped[:5]]
        lines += ["  ..."] if len(log.skipped) > 5 else []
    return "\n".join(lines)


def recorders_of(command: Command, log: RecordedLog, folder: RunFolder) -> list[ReplayRecorder]:
    """Those that the command asks for."""
    from experiments import run_folder
    from experiments.replaying.progress import ReplayProgress

    watchers: list[ReplayRecorder] = [ReplayProgress(log)]
    if command.record:
        from experiments.recorders.rerun_replay import RerunReplay

        watchers.append(RerunReplay(folder / run_folder.RECORDING, command.replay.map))
    return watchers


def whereabouts_in(localizer: ReplayLocalizer) -> Whereabouts | None:
    """Whoever follows a robot in a finished map may lose it; whoever makes one does not."""
    from experiments.replaying.whereabouts import Whereabouts
    from occmap.localization.map_localizer import MapLocalizer

    return Whereabouts(localizer) if isinstance(localizer, MapLocalizer) else None


def write(
    replayed: Replayed,
    relations: Relations | None,
    whereabouts: Whereabouts | None,
    folder: RunFolder,
    command: Command,
) -> str:
    """All files, and the figures that people look at first."""
    from experiments.replaying.results import summarise, write_results
    from experiments.score_trajectory import relations_lines

    summary, score = summarise(replayed, relations, whereabouts, command)
    write_results(replayed, summary, folder)
    ms = summary.scan_ms
    lines = [
        f"{summary.path_length_m:.0f} m driven, {summary.real_time_factor:.0f} x real time; a scan takes "
        f"{ms['p50']:.2f} ms (median), {ms['mean']:.2f} (mean), {ms['max']:.1f} (max)",
        *([whereabouts.text()] if whereabouts is not None else ()),
        *(relations_lines(score) if score is not None else ()),
        f"results in {folder.path}",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
