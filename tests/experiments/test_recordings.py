"""A recording is there whole or not at all, whoever else makes it at the same time."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from experiments.config import ExperimentConfig
from experiments.sweeping import recordings
from experiments.sweeping.recordings import RecordingJob, record

SAME = "the same map"


def recorded(job: RecordingJob, into: Path) -> SimpleNamespace:
    """What recording a run leaves, and no run."""
    into.mkdir(parents=True)
    (into / "recording.rrd").write_text("mine")
    (into / "summary.json").write_text("{}")
    return SimpleNamespace(status="complete", map_sha256=SAME)


@pytest.fixture
def job(tmp_path, monkeypatch) -> RecordingJob:
    monkeypatch.setattr(recordings, "_recorded", recorded)
    return RecordingJob(ExperimentConfig(), "", (), tmp_path / "recordings" / "office-0", SAME)


def test_a_recording_has_its_name_once_it_is_whole(job, monkeypatch):
    def watched(job: RecordingJob, into: Path) -> SimpleNamespace:
        assert not job.folder.exists()
        return recorded(job, into)

    monkeypatch.setattr(recordings, "_recorded", watched)
    assert record(job).row["status"] == "complete"
    assert list(job.folder.parent.iterdir()) == [job.folder]
    assert (job.folder / "recording.rrd").read_text() == "mine"


def test_a_whole_recording_of_another_shard_is_kept(job):
    job.folder.mkdir(parents=True)
    for name in ("recording.rrd", "summary.json"):
        (job.folder / name).write_text("theirs")
    assert record(job).row["status"] == "complete"
    assert list(job.folder.parent.iterdir()) == [job.folder]
    assert (job.folder / "recording.rrd").read_text() == "theirs"


@pytest.mark.parametrize(
    ("status", "map_sha256", "kept"),
    [("interrupted", SAME, "interrupted"), ("complete", "another map", "crashed")],
)
def test_of_a_recording_that_is_none_nothing_is_left(job, monkeypatch, status, map_sha256, kept):
    def spoilt(job: RecordingJob, into: Path) -> SimpleNamespace:
        recorded(job, into)
        return SimpleNamespace(status=status, map_sha256=map_sha256)

    monkeypatch.setattr(recordings, "_recorded", spoilt)
    assert record(job).row["status"] == kept
    assert not list(job.folder.parent.iterdir())
