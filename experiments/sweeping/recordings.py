"""Recordings of the runs worth looking at: the same runs again, watched.

A run follows from its config, so nothing need be recorded until it is known which ones are interesting.
"""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.run_folder import SUMMARY, RunFolder
from experiments.sweeping.groups import Naming, group
from experiments.sweeping.jobs import CRASHED, INTERRUPTED, Job, Result, Row, crashed
from experiments.sweeping.pool import is_stopping
from experiments.sweeping.store import Store
from experiments.sweeping.worst import Badness

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.summary import Summary


@dataclass(frozen=True)
class Keep:
    """Which recordings to keep: `worst:10`, `all` or `none`."""

    most: float
    """So many of the worst."""

    @staticmethod
    def parse(text: str) -> Keep:
        """ValueError for anything else."""
        word, _, number = text.partition(":")
        if text in ("all", "none"):
            return Keep(float("inf") if text == "all" else 0)
        if word == "worst" and number.isdecimal() and int(number) > 0:
            return Keep(int(number))
        raise ValueError(f"keep_recordings must be all, none or worst:N, got {text!r}")


@dataclass(frozen=True)
class RecordingJob(Job):
    """A run to be done again, into a folder of its own."""

    folder: Path = Path()
    map_sha256: str = ""
    """Of the map that it made the first time."""


def to_record(store: Store, keep: Keep) -> dict[str, Row]:
    """Of the runs gathered in a sweep's folder those that are to be recorded, by key."""
    if not keep.most:
        return {}
    done = (row for row in store.rows() if row["status"] != CRASHED)
    if keep.most == float("inf"):
        return {row["key"]: _known(row) for row in done}
    naming = Naming.of(store.rows())
    badness = Badness(group(store.rows(), naming), naming)
    return {row["key"]: _known(row) for row in badness.worst(done, int(keep.most))}


def _known(row: Row) -> Row:
    """What a recording needs to know of a run: not its curve, when there are many."""
    return {name: row[name] for name in ("name", "seed", "key", "map_sha256")}


def recording_jobs(jobs: Iterable[Job], wanted: dict[str, Row], store: Store) -> Iterator[RecordingJob]:
    """Those of the jobs whose recording is wanted and not there yet."""
    for job in jobs:
        if (row := wanted.get(job.key)) is None:
            continue
        folder = store.recording_folder(row)
        if not (folder / SUMMARY).exists():
            yield RecordingJob(job.config, job.code, job.options, folder, row["map_sha256"])


def record(job: Job) -> Result:
    """Run once more with the recording and the plot on; the folder is like any that `explore` leaves."""
    assert isinstance(job, RecordingJob)
    beside = job.folder.with_name(f".{job.folder.name}.{uuid.uuid4().hex[:8]}")
    try:
        summary = _recorded(job, beside)
        if summary.status != INTERRUPTED:
            if summary.map_sha256 != job.map_sha256:
                raise RuntimeError(f"the run did not repeat itself: its map was {job.map_sha256}")
            _keep(beside, job.folder)
    except Exception as error:
        return crashed(job, f"{type(error).__name__}: {error}")
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return Result(job.identity() | {"status": summary.status})


def _keep(beside: Path, folder: Path) -> None:
    """Give a recording its name, unless another shard was faster: the two are the same."""
    try:
        beside.rename(folder)
    except OSError:
        if not (folder / SUMMARY).exists():
            raise


def _recorded(job: RecordingJob, into: Path) -> Summary:
    from experiments.experiment import prepare
    from experiments.recorders import Recorder
    from experiments.recorders.coverage_plot import CoveragePlot
    from experiments.recorders.rerun_recorder import RerunRecorder
    from experiments.run import run
    from experiments.run_folder import PLOT, RECORDING
    from experiments.summary import summarise

    folder = RunFolder.create(into)
    folder.write_config(job.config.pinned())
    experiment = prepare(job.config)

    def recorders(curve: ScoreCurve) -> list[Recorder]:
        return [
            RerunRecorder(folder / RECORDING, experiment.setting, curve, experiment.scorer.truth),
            CoveragePlot(folder / PLOT, curve, experiment.building.name),
        ]

    finished = run(experiment, recorders, is_stopping)
    if finished.unrecorded:
        raise RuntimeError("; ".join(finished.unrecorded))
    summary = summarise(finished)
    if summary.status != INTERRUPTED:
        folder.write_results(finished, summary)
    return summary
