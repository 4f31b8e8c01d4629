"""The main job from the command line to its files."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
import pytest
import yaml
from scipy import ndimage

from experiments.explore import main, wall_error
from experiments.recorders.coverage_plot import CoveragePlot
from experiments.run_folder import MARKS
from experiments.summary import MEASURED, Summary
from occmap.geometry import Twist2
from sim.faults import PhysicsFault
from sim.robot import Robot

ROOT = Path(__file__).resolve().parent.parent.parent
QUICK = ["--no-record", "--no-video", "--seed", "5"]
SMALL = [*QUICK, "--building.kind", "apartment", "--building.size-m", "10", "8", "--time-limit-s", "40"]


def summary_in(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def unmeasured(summary: dict[str, Any]) -> dict[str, Any]:
    """All that must come out the same every time."""
    return {key: value for key, value in summary.items() if key not in MEASURED}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run, cut off by its time limit."""
    path = tmp_path_factory.mktemp("runs") / "small"
    assert main([*SMALL, "--out", str(path)]) == 3
    return path


def test_the_run_folder_is_complete(folder):
    names = "config.json summary.json map.yaml map.pgm truth.yaml truth.pgm explorable.pgm "
    names += "trajectory.tum truth.tum coverage.png"
    assert sorted(file.name for file in folder.iterdir()) == sorted(names.split())
    assert set(names.split()) <= set(MARKS)


def test_a_map_without_a_wall_has_no_wall_error():
    assert wall_error(0.0123) == "wall error 1.2 cm"
    assert wall_error(math.nan) == "no wall in the map"


def test_the_summary_keeps_its_contract(folder):
    summary = summary_in(folder)
    assert list(summary) == [field.name for field in fields(Summary)]
    assert summary["status"] == "time_limit"
    assert summary["honest"] is True
    assert 0.0 < summary["explored"] <= 1.0
    assert summary["sim_time_s"] == pytest.approx(40.0)
    assert set(summary["wall_error_m"]) == {"mean", "p95"}
    assert set(summary["collisions"]) == {"events", "duration_s"}
    assert set(summary["decision_ms"]) == {"p50", "p99", "max"}
    assert set(summary["milestones"]) == {"50", "90", "95", "99"}
    stages = {"physics", "lidar", "mapping", "frontiers", "planning", "recording"}
    assert stages <= set(summary["wall_time_by_stage_s"])
    assert {"kind", "size_m", "rooms", "doors", "obstacles", "free_area_m2"} <= set(summary["building"])
    assert 0.0 < summary["ate_m"] < 0.02


def test_trajectories_hold_a_line_per_scan(folder):
    estimate, truth = (np.loadtxt(folder / name) for name in ("trajectory.tum", "truth.tum"))
    assert estimate.shape == truth.shape == (400, 8)
    np.testing.assert_allclose(np.diff(truth[:, 0]), 0.1, atol=1e-6)
    np.testing.assert_allclose(estimate[:, :4], truth[:, :4], atol=0.05)


def test_with_the_true_pose_the_estimate_is_the_truth(tmp_path):
    assert main([*SMALL, "--pose", "truth", "--time-limit-s", "8", "--out", str(tmp_path / "run")]) == 3
    estimate, truth = (np.loadtxt(tmp_path / "run" / name) for name in ("trajectory.tum", "truth.tum"))
    np.testing.assert_allclose(estimate, truth, atol=1e-6)
    assert summary_in(tmp_path / "run")["ate_m"] == pytest.approx(0.0, abs=1e-9)


def belief_at(points: np.ndarray, folder: Path, name: str) -> np.ndarray:
    """The pixels of a Nav2 map at (n, 2) places in the world; 205 outside."""
    described = yaml.safe_load((folder / f"{name}.yaml").read_text())
    pixels = imageio.imread(folder / described["image"])[::-1]
    x, y, yaw = described["origin"]
    to = points - (x, y)
    along = np.column_stack(
        (np.cos(yaw) * to[:, 0] + np.sin(yaw) * to[:, 1], np.cos(yaw) * to[:, 1] - np.sin(yaw) * to[:, 0])
    )
    ix, iy = np.floor(along / described["resolution"]).astype(int).T
    inside = (ix >= 0) & (ix < pixels.shape[1]) & (iy >= 0) & (iy < pixels.shape[0])
    values = np.full(len(points), 205)
    values[inside] = pixels[iy[inside], ix[inside]]
    return values


def test_anyone_can_recompute_the_scores_from_the_files(folder):
    described = yaml.safe_load((folder / "truth.yaml").read_text())
    wall = imageio.imread(folder / "truth.pgm")[::-1] == 0
    explorable = imageio.imread(folder / "explorable.pgm")[::-1] == 255
    iy, ix = np.indices(wall.shape)
    r = described["resolution"]
    centres = (np.column_stack((ix.ravel(), iy.ravel())) + 0.5) * r + described["origin"][:2]
    belief = belief_at(centres, folder, "map").reshape(wall.shape)
    free, occupied = belief == 254, belief == 0

    around = np.ones((3, 3))
    rim = explorable & ndimage.binary_dilation(wall, around)
    surface = wall & ndimage.binary_dilation(explorable, around)
    seen = surface & ndimage.binary_dilation(occupied, around)
    wrong = (explorable & ~rim & occupied).sum() + (surface & ~seen & free).sum()
    summary, area = summary_in(folder), explorable.sum()
    assert summary["explored"] == pytest.approx(
        (explorable & (free | (rim & occupied))).sum() / area, abs=1e-6
    )
    assert summary["known"] == pytest.approx((explorable & (free | occupied)).sum() / area, abs=1e-6)
    assert summary["wrong"] == pytest.approx(wrong / area, abs=1e-6)
    assert summary["wall_recall"] == pytest.approx(seen.sum() / surface.sum(), abs=1e-6)
    assert summary["explorable_area_m2"] == pytest.approx(area * r**2)


def test_another_process_comes_to_the_same_result(folder, tmp_path):
    again = tmp_path / "again"
    done = subprocess.run(
        [sys.executable, "-m", "experiments.explore", *SMALL, "--out", str(again)], cwd=ROOT, check=False
    )
    assert done.returncode == 3
    assert unmeasured(summary_in(again)) == unmeasured(summary_in(folder))
    for name in ("map.pgm", "map.yaml", "trajectory.tum", "config.json"):
        assert (again / name).read_bytes() == (folder / name).read_bytes()


def test_recording_does_not_influence_the_run(folder, tmp_path):
    config = ["--config", str(folder / "config.json"), "--time-limit-s", "5"]
    assert main([*config, "--out", str(tmp_path / "watched")]) == 3
    assert main([*config, "--no-record", "--no-video", "--out", str(tmp_path / "alone")]) == 3
    assert unmeasured(summary_in(tmp_path / "watched")) == unmeasured(summary_in(tmp_path / "alone"))
    assert (tmp_path / "watched" / "recording.rrd").stat().st_size > 10_000
    assert (tmp_path / "watched" / "exploration.mp4").stat().st_size > 10_000


def test_a_config_file_runs_the_same_again(folder, tmp_path):
    again = tmp_path / "again"
    config = ["--config", str(folder / "config.json")]
    assert main(["--no-record", "--no-video", *config, "--out", str(again)]) == 3
    assert unmeasured(summary_in(again)) == unmeasured(summary_in(folder))


def test_options_beside_a_config_file_win_and_are_named(folder, tmp_path, capsys):
    config = ["--config", str(folder / "config.json")]
    main(["--no-record", "--no-video", *config, "--time-limit-s", "2", "--out", str(tmp_path / "again")])
    assert "time_limit_s = 40.0; the command line wins with 2.0" in capsys.readouterr().err
    assert summary_in(tmp_path / "again")["sim_time_s"] == pytest.approx(2.0)


def test_an_earlier_run_is_never_overwritten(folder, capsys):
    before = (folder / "summary.json").read_bytes()
    assert main([*SMALL, "--out", str(folder)]) == 2
    assert "holds a run already" in capsys.readouterr().err
    assert (folder / "summary.json").read_bytes() == before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_asked_to_stop_keeps_what_it_has(tmp_path, number):
    out = tmp_path / "run"
    command = [
        sys.executable,
        "-m",
        "experiments.explore",
        *QUICK,
        "--building.kind",
        "maze",
        "--out",
        str(out),
    ]
    job = subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "PYTHONUNBUFFERED": "1"}, stderr=subprocess.PIPE
    )
    while not (out / "config.json").exists():
        assert job.poll() is None
        time.sleep(0.05)
    time.sleep(2.0)
    job.send_signal(number)
    job.communicate(timeout=120)
    assert job.returncode == 128 + number
    assert summary_in(out)["status"] == "interrupted"
    assert (out / "map.pgm").exists()


def test_a_physics_fault_ends_the_run_with_its_reason_and_what_there_is(tmp_path, capsys, monkeypatch):
    act = Robot.act

    def fail_later(robot: Robot, twist: Twist2) -> None:
        if robot.time_s > 5.0:
            raise PhysicsFault("physics fault at t = 5.1 s: the state is not finite")
        act(robot, twist)

    monkeypatch.setattr(Robot, "act", fail_later)
    assert main([*SMALL, "--out", str(tmp_path / "run")]) == 5
    assert "physics fault at t = 5.1 s" in capsys.readouterr().err
    assert summary_in(tmp_path / "run")["status"] == "physics_fault"


def test_doors_close_by_their_number_in_the_building_alone(tmp_path):
    """The room of the warm-up has none."""
    options = ["--faults.close-doors-at-s", "0", "--faults.close-doors", "2", "--time-limit-s", "3"]
    assert main([*SMALL, *options, "--out", str(tmp_path / "run")]) == 3
    assert summary_in(tmp_path / "run")["status"] == "time_limit"


@pytest.mark.parametrize(("limit_s", "status"), [("2", 3), ("200", 1)])
def test_a_recorder_that_fails_at_the_end_costs_its_own_file_only(
    tmp_path, capsys, monkeypatch, limit_s, status
):
    def disk_full(_: CoveragePlot) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(CoveragePlot, "close", disk_full)
    imageio.imwrite(tmp_path / "hall.png", np.full((50, 60), 255, np.uint8))
    plan = ["--plan", str(tmp_path / "hall.png"), "--plan-resolution-m", "0.1", "--time-limit-s", limit_s]
    assert main([*QUICK, *plan, "--no-video", "--record", "--out", str(tmp_path / "run")]) == status
    said = capsys.readouterr().err
    assert "error: not written, CoveragePlot: OSError: no space left on device" in said
    left = {"map.yaml", "truth.tum", "summary.json", "recording.rrd"}
    assert left <= {file.name for file in (tmp_path / "run").iterdir()}
