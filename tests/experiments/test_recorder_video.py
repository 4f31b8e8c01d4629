"""A film of any run lasts 20 to 60 s and plays everywhere."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from imageio_ffmpeg import read_frames
from PIL import Image

from experiments.recorders.camera import drawing_camera, rendering_camera
from experiments.recorders.coverage_plot import CoveragePlot, draw_coverage, reached
from experiments.recorders.snapshots import SnapshotLog
from experiments.recorders.video_recorder import VideoConfig, VideoRecorder
from tests.experiments.fake_episode import START, FakeCurve, fake_episode, setting

SMALL = VideoConfig(width_px=640, snapshots=20)


def film(path, steps: int, config: VideoConfig = SMALL, open_camera=drawing_camera):
    curve = FakeCurve([])
    video = VideoRecorder(path, setting(), curve, config, open_camera)
    for step in fake_episode(steps, curve, beams=24):
        video.record(step)
    video.close()
    reader = read_frames(str(path))
    return next(reader), reader


@pytest.mark.parametrize("steps", [1, 30, 500])
def test_a_film_lasts_20_to_60_seconds_however_long_the_run(tmp_path, steps):
    meta, _ = film(tmp_path / "exploration.mp4", steps)
    assert 20.0 <= meta["duration"] <= 60.0
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert all(side % 2 == 0 for side in meta["size"])


def test_the_camera_sees_every_moment_once_and_fills_the_right_panel(tmp_path):
    shots = []

    @contextmanager
    def red_camera(_, size_px):
        def shoot(shot):
            shots.append(shot.time_s)
            return Image.new("RGB", size_px, (255, 0, 0))

        yield shoot

    meta, frames = film(tmp_path / "exploration.mp4", 30, open_camera=red_camera)
    assert shots == sorted(set(shots))
    width, height = meta["size"]
    frame = np.frombuffer(next(frames), np.uint8).reshape(height, width, 3)
    red = (frame[..., 0] > 200) & (frame[..., 1:] < 60).all(axis=2)
    assert red[:, width // 2 + 8 :].mean() > 0.5
    assert red[:, : width // 2 - 8].mean() < 0.01


def test_both_cameras_take_pictures_of_the_size_asked_for():
    (step,) = fake_episode(1, beams=12)
    log = SnapshotLog(START, FakeCurve([]))
    log.record(step)
    for open_camera in (rendering_camera, drawing_camera):
        with open_camera(setting(), (320, 240)) as camera:
            picture = camera(log.snapshots[0])
        assert picture.size == (320, 240)
        assert len(picture.getcolors(1 << 17) or []) > 10


@pytest.mark.parametrize("open_camera", [rendering_camera, drawing_camera])
def test_a_closed_door_is_shown_closed(open_camera):
    (step,) = fake_episode(1, beams=12)
    log = SnapshotLog(START, FakeCurve([]))
    log.record(step)
    shot = log.snapshots[0]
    with open_camera(setting(), (320, 240)) as camera:
        opened, closed = (
            np.asarray(camera(replace(shot, door_heights_m=(height_m,))), int) for height_m in (0.0, 1.0)
        )
    rows, columns = np.nonzero(np.abs(opened - closed).sum(axis=2) > 60)
    px_per_m = 320 / 12.0
    assert columns.mean() == pytest.approx(160 + 1.0 * px_per_m, abs=5)  # it stands at (7, 4) of 12 m x 8 m
    assert rows.mean() == pytest.approx(120, abs=5)
    assert 0 < len(rows) < 0.03 * opened[..., 0].size


def test_without_graphics_the_world_is_drawn(monkeypatch):
    monkeypatch.setattr("sim.render.open_studio", lambda *_: None)
    (step,) = fake_episode(1, beams=12)
    log = SnapshotLog(START, FakeCurve([]))
    log.record(step)
    with rendering_camera(setting(), (320, 240)) as camera, drawing_camera(setting(), (320, 240)) as drawn:
        assert camera(log.snapshots[0]).tobytes() == drawn(log.snapshots[0]).tobytes()


def test_a_run_without_a_scan_leaves_no_film_and_no_plot(tmp_path):
    VideoRecorder(tmp_path / "a.mp4", setting(), FakeCurve([]), SMALL).close()
    CoveragePlot(tmp_path / "a.png", FakeCurve([])).close()
    assert not list(tmp_path.iterdir())


def test_the_plot_marks_the_milestones_that_were_reached(tmp_path):
    curve = FakeCurve([])
    for _ in fake_episode(100, curve, beams=12):
        pass
    assert [percent for percent, _ in reached(curve.samples)] == [50, 90, 95]
    draw_coverage(curve.samples, tmp_path / "coverage.png", "a fake hall")
    assert Image.open(tmp_path / "coverage.png").width == 1200


@pytest.mark.parametrize("bad", [{"width_px": 641}, {"snapshots": 1}, {"frames_per_s": 0}])
def test_nonsense_is_refused(bad):
    with pytest.raises(ValueError, match="got"):
        VideoConfig(**bad)
