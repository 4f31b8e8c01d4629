"""A recording, read back as a viewer would."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from experiments.recorders.rerun_recorder import RerunConfig, RerunRecorder
from occmap.geometry import Pose2
from sim.truth import truth_grid
from tests.experiments.fake_episode import START, FakeCurve, building, door_height_m, fake_episode, setting

STEPS = 60
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The chunks of a fake episode's recording, and the last step of it."""
    path, curve = tmp_path_factory.mktemp("rerun") / "recording.rrd", FakeCurve([])
    rr.set_strict_mode(True)
    recorder = RerunRecorder(path, setting(), curve, truth_grid(building(), 0.05))
    for step in fake_episode(STEPS, curve):
        recorder.record(step)
    recorder.close()
    rr.set_strict_mode(False)
    return list(RrdReader(path).stream()), step


def entities(chunks) -> set[str]:
    return {chunk.entity_path for chunk in chunks}


def rows(chunks, entity: str, component: str) -> list[tuple[float, list]]:
    """(seconds, value) of every row of one component, in order of time."""
    found = []
    for chunk in chunks:
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            if component in batch.schema.names:
                times_s = [t.total_seconds() for t in batch.column("sim_time").to_pylist()]
                found += zip(times_s, batch.column(component).to_pylist(), strict=True)
    return sorted((row for row in found if row[1] is not None), key=lambda row: row[0])


def test_everything_people_look_at_is_there(recorded):
    expected = {
        "/world/map",
        "/world/building/wall/boxes",
        "/world/building/column/cylinders",
        "/world/truth",
        "/world/true_robot",
        "/world/true_trail",
        *(
            f"/world/map/{name}"
            for name in ("robot", "trail", "path", "goal", "frontiers", "chosen_frontier")
        ),
        *(f"/world/map/beams/{name}" for name in ("ends", "hit", "no_return")),
        *(f"/curves/{name}" for name in ("explored", "path_length", "pose_error", "wrong_cells")),
        "/activity",
        "/decisions",
    }
    assert expected <= entities(recorded[0])
    assert any(path.startswith("/world/map/belief/") for path in entities(recorded[0]))


def test_time_is_simulated_time_and_nothing_else(recorded):
    moving = [chunk for chunk in recorded[0] if not chunk.is_static]
    assert {tuple(chunk.timeline_names) for chunk in moving} == {("sim_time",)}


def test_the_belief_is_not_mirrored(recorded):
    """Each tile, placed as rerun documents it (row 0 on top, low corner at the translation), is the grid."""
    chunks, last = recorded
    shown = np.zeros(last.grid.shape, np.uint8)
    for entity in sorted(path for path in entities(chunks) if "/belief/" in path):
        blob = rows(chunks, entity, "GridMap:data")[-1][1][0]
        (placing,) = (c.to_record_batch() for c in chunks if c.entity_path == entity and c.is_static)
        x_m, y_m, _ = placing.column("GridMap:translation").to_pylist()[0][0]
        side = round(len(blob) ** 0.5)
        image = np.array(blob, np.uint8).reshape(side, side)
        for row, column in np.argwhere(image != 255):
            centre_m = (x_m + (column + 0.5) * 0.05, y_m + (side - row - 0.5) * 0.05)
            ix, iy = last.grid.frame.cell_at(*centre_m)
            shown[iy, ix] = {0: 1, 100: 2}[int(image[row, column])]
    assert np.array_equal(shown, last.grid.state)


def test_the_map_frame_is_placed_by_the_true_start(recorded):
    chunks, last = recorded
    (placing,) = (c.to_record_batch() for c in chunks if c.entity_path == "/world/map" and c.is_static)
    (x_m, y_m, _), (_, _, sine, cosine) = (
        placing.column(f"Transform3D:{name}").to_pylist()[0][0] for name in ("translation", "quaternion")
    )
    world_from_map = Pose2(x_m, y_m, 2.0 * np.arctan2(sine, cosine))
    seen_x_m, seen_y_m, _ = rows(chunks, "/world/map/robot", "Transform3D:translation")[-1][1][0]
    seen = world_from_map.apply(np.array([[seen_x_m, seen_y_m]]))[0]
    assert np.allclose(seen, (START @ last.decision.map_from_robot).position, atol=1e-4)


def test_the_truth_waits_to_be_revealed(recorded):
    (truth,) = (c.to_record_batch() for c in recorded[0] if c.entity_path == "/world/truth")
    wall = truth_grid(building(), 0.05).wall
    image = np.array(truth.column("GridMap:data").to_pylist()[0][0], np.uint8).reshape(*wall.shape, 4)
    assert np.array_equal(image[::-1, :, 3] > 0, wall)


def test_activities_and_decisions_are_logged_when_they_change(recorded):
    states = [(round(t, 1), value[0]) for t, value in rows(recorded[0], "/activity", "StateChange:state")]
    assert states == [(0.0, "exploring"), (2.0, "recovering"), (2.6, "exploring"), (5.9, "complete")]
    texts = [value[0] for _, value in rows(recorded[0], "/decisions", "TextLog:text")]
    assert texts
    assert all(text.startswith("frontier at (") for text in texts)


def test_a_closing_door_comes_out_of_the_floor(recorded):
    heights_m = rows(recorded[0], "/world/building/doors", "Boxes3D:half_sizes")
    assert heights_m[0] == (0.0, [])  # an open door is not there
    assert len(heights_m) == 11  # while it rises, and never after
    for time_s, panels in heights_m[1:]:
        assert panels[0][2] == pytest.approx(door_height_m(time_s) / 2.0)
    assert heights_m[-1][1][0][2] == pytest.approx(0.5)


def test_beams_are_thinned_evenly(recorded):
    chunks, last = recorded
    hits = rows(chunks, "/world/map/beams/ends", "Points3D:positions")[-1][1]
    rays = [
        rows(chunks, f"/world/map/beams/{name}", "LineStrips3D:strips")[-1][1] or []
        for name in ("hit", "no_return")
    ]
    assert len(hits) == last.observation.scan.is_hit.sum()
    assert 0 < sum(map(len, rays)) <= RerunConfig().rays


KILLED = """
import os, signal, sys
from pathlib import Path
from experiments.recorders.rerun_recorder import RerunRecorder
from tests.experiments.fake_episode import FakeCurve, fake_episode, setting
recorder = RerunRecorder(Path(sys.argv[1]), setting(), FakeCurve([]))
for k, step in enumerate(fake_episode(200)):
    recorder.record(step)
    if k == 150:
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_killed_run_leaves_a_recording_that_lacks_at_most_its_last_second(tmp_path):
    path = tmp_path / "recording.rrd"
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    killed = subprocess.run([sys.executable, "-c", KILLED, str(path)], env=environment, cwd=ROOT, check=False)
    assert killed.returncode == -signal.SIGKILL
    chunks = list(RrdReader(path).stream())
    assert rows(chunks, "/world/map/robot", "Transform3D:translation")[-1][0] >= 15.0 - 1.0


@pytest.mark.parametrize("bad", [{"motion_period_s": 0.0}, {"rays": 0}, {"quantum_m": -1.0}])
def test_nonsense_is_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        RerunConfig(**bad)
