"""A replay's recording, read back as a viewer would."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from experiments.recorders.rerun_replay import RerunReplay
from experiments.replaying.runner import ReplayStep
from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization import Estimate
from occmap.mapper import Mapper
from occmap.scan import Observation, Scan

SCANS = 30


def step(k: int, grid: OccupancyGrid | None = None) -> ReplayStep:
    """A robot drives towards a wall 5 m ahead, its wheels a tenth too large."""
    scan = Scan(np.linspace(-0.5, 0.5, 21), 5.0 - 0.1 * k + np.zeros(21), 50.0)
    pose = Pose2(0.1 * k, 0.0, 0.0)
    seen = Observation(1000.0 + 0.2 * k, Pose2(0.11 * k, 0.0, 0.0), scan, Pose2.identity())
    return ReplayStep(seen, Estimate(pose, grid=grid))


@pytest.fixture(scope="module")
def chunks(tmp_path_factory: pytest.TempPathFactory) -> list:
    path = tmp_path_factory.mktemp("replay") / "recording.rrd"
    rr.set_strict_mode(True)
    recorder = RerunReplay(path, GridConfig())
    corrected = OccupancyGrid()
    for k in range(SCANS):
        if k == 20:
            mapped = step(0)
            Mapper().insert(mapped.observation.scan, Pose2(20.0, 20.0, 0.0), corrected)
        recorder.record(step(k, corrected if k == 20 else None))
    poses = [step(k).estimate.map_from_robot for k in range(SCANS)]
    recorder.finish(poses, corrected)
    recorder.close()
    rr.set_strict_mode(False)
    return list(RrdReader(path).stream())


def times_s(chunks: list, entity: str) -> list[float]:
    """When something was logged there, in order."""
    found: list[float] = []
    for chunk in chunks:
        if chunk.entity_path == entity and not chunk.is_static:
            found += [t.total_seconds() for t in chunk.to_record_batch().column("log_time").to_pylist()]
    return sorted(found)


def test_everything_people_look_at_is_there(chunks: list):
    entities = {chunk.entity_path for chunk in chunks}
    for entity in ("robot", "trail", "final_trail", "beams/ends"):
        assert f"/world/map/{entity}" in entities
    assert any(entity.startswith("/world/map/belief/") for entity in entities)
    assert "/curves/odometry_drift" in entities


def test_time_begins_with_the_log(chunks: list):
    at = times_s(chunks, "/world/map/robot")
    assert at[0] == 0.0
    assert at[-1] == pytest.approx(0.2 * (SCANS - 1), abs=0.4)


def test_a_corrected_map_replaces_the_live_one(chunks: list):
    assert times_s(chunks, "/events") == pytest.approx([4.0])
    assert times_s(chunks, "/world/map/belief/3_3")[0] == pytest.approx(4.0), "where the corrected map lies"


def test_a_recording_can_be_made_in_a_folder_only(tmp_path: Path):
    with pytest.raises(Exception, match="none"):
        RerunReplay(tmp_path / "none" / "recording.rrd", GridConfig())
