"""Maps that outlive a replay: saved, gone on from, localised in."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from experiments.exit_status import LOST
from experiments.replay import main
from experiments.tum_file import read_tum
from occmap.geometry import Pose2
from tests.experiments.commands import mistake

LOG = Path(__file__).parent.parent / "data" / "intel_part.clf.gz"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log in one run, and in two of which the second goes on from the first."""
    folder = tmp_path_factory.mktemp("states")
    lines = [line for line in gzip.decompress(LOG.read_bytes()).decode().splitlines(True) if line[0] == "F"]
    for name, part in (("whole", lines), ("first", lines[:250]), ("second", lines[250:])):
        (folder / f"{name}.clf").write_text("".join(part))
    state = str(folder / "state")
    assert replay(folder, "whole", "whole") == 0
    assert replay(folder, "first", "first", "--save-state", state) == 0
    assert replay(folder, "second", "second", "--continue-from", state) == 0
    return folder


def replay(folder: Path, log: str, out: str, *options: str) -> int:
    return main([str(folder / f"{log}.clf"), "--out", str(folder / out), "--no-record", *options])


def sha(folder: Path) -> str:
    return summary(folder)["map_sha256"]


def summary(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def test_saved_and_gone_on_from_is_the_map_of_one_run(runs: Path):
    assert sha(runs / "second") == sha(runs / "whole") != sha(runs / "first")
    whole, second = (read_tum(runs / name / "trajectory.tum") for name in ("whole", "second"))
    assert len(second) == len(whole) - 250
    index, _ = whole.nearest(second.times_s)
    np.testing.assert_array_equal(whole.poses[index], second.poses)


@pytest.mark.parametrize("start", [None, (0.0, 0.0, 0.0), (7.0, -3.0, 2.5)])
def test_the_robot_is_followed_in_a_map_from_a_right_start_a_wrong_one_and_none(
    runs: Path, start: tuple[float, float, float] | None
):
    """The second part was driven where the first one had mapped, but for its end, where it is lost: so does
    its status say. The first scan's pose is not (0, 0, 0)."""
    options = ["--localize-in", str(runs / "state")]
    if start == (0.0, 0.0, 0.0):
        start = tuple(read_tum(runs / "second" / "trajectory.tum").poses[0].tolist())
    if start is not None:
        options += ["--start", *map(str, start)]
    out = f"localized{0 if start is None else abs(int(start[0] * 1000))}"
    assert replay(runs, "second", out, *options) == LOST
    true, found = (read_tum(runs / name / "trajectory.tum").poses for name in ("second", out))
    off_m = np.hypot(*(true - found)[:, :2].T)
    assert np.median(off_m) < 0.05
    assert np.percentile(off_m, 95) < 0.3
    assert sha(runs / out) == sha(runs / "first"), "the map stays what it is"
    localized = summary(runs / out)["localized"]
    assert 0.7 < localized["known_share"] < 0.9
    assert localized["is_lost"]


def test_a_robot_that_stays_in_the_map_is_found(runs: Path, capsys):
    assert replay(runs, "first", "again", "--localize-in", str(runs / "state")) == 0
    assert "found: " in capsys.readouterr().err
    localized = summary(runs / "again")["localized"]
    assert localized["known_share"] > 0.9
    assert not localized["is_lost"]


@pytest.mark.parametrize("start", [[], ["--start", "0", "0", "0"]])
def test_a_robot_that_is_not_in_the_map_is_said_to_be_lost(runs: Path, start: list[str], capsys):
    """Beams as long as they please: no place looks like that."""
    ranges = " ".join(map("{:.2f}".format, np.random.default_rng(0).uniform(1.0, 8.0, 180)))
    lines = [f"FLASER 180 {ranges} {k / 10} 0 0 {k / 10} 0 0 {k} host {k}\n" for k in range(30)]
    (runs / "nowhere.clf").write_text("".join(lines))
    out = f"nowhere{len(start)}"
    assert replay(runs, "nowhere", out, "--localize-in", str(runs / "state"), *start) == LOST
    assert "lost: " in capsys.readouterr().err
    localized = summary(runs / out)["localized"]
    assert localized["known_share"] < 0.5
    assert localized["is_lost"]


def test_whoever_makes_a_map_is_not_lost(runs: Path):
    assert summary(runs / "whole")["localized"] is None


@pytest.mark.parametrize(
    "ended",
    [
        None,
        Pose2(50.0, 20.0, 1.0),
        Pose2(0.3, 0.2, 3.0),
        Pose2(0.3, 0.2, 0.05),
    ],
)
def test_a_robot_goes_on_the_next_day_where_it_stood(runs: Path, ended: Pose2 | None):
    """Its odometry goes on, too, or begins anew: where it ended had been so far from there."""
    first = odometry((runs / "second.clf").read_text().splitlines()[0])
    last = odometry((runs / "first.clf").read_text().splitlines()[-1])
    moved_by = Pose2.identity() if ended is None else last @ ended.inverse() @ first.inverse()
    out = "next_day" if ended is None else f"anew{ended.x_m}_{ended.yaw_rad}"
    write_the_next_day(runs / "second.clf", runs / f"{out}.clf", moved_by)
    assert replay(runs, out, out, "--continue-from", str(runs / "state")) == 0
    one, other = (read_tum(runs / name / "trajectory.tum").poses for name in ("second", out))
    assert np.hypot(*(one - other)[:, :2].T).max() < 0.1
    assert math.degrees(np.abs(one - other)[:, 2].max()) < 1.0


def odometry(line: str) -> Pose2:
    return Pose2(*map(float, line.split()[-6:-3]))


def write_the_next_day(source: Path, target: Path, moved_by: Pose2) -> None:
    """A log as if recorded a day later, its odometry moved."""
    lines = []
    for line in source.read_text().splitlines():
        words, odom = line.split(), moved_by @ odometry(line)
        words[-9:-3] = 2 * [f"{odom.x_m:.6f}", f"{odom.y_m:.6f}", f"{odom.yaw_rad:.6f}"]
        words[-3] = f"{float(words[-3]) + 86_400.0:.6f}"
        lines.append(" ".join(words))
    target.write_text("\n".join(lines))


@pytest.mark.parametrize(
    "options",
    [
        ["--continue-from", "none"],
        ["--localize-in", "none.clf"],
        ["--continue-from", "state", "--localize-in", "state"],
        ["--continue-from", "state", "--map.resolution-m", "0.1"],
        ["--localize-in", "state", "--save-state", "other"],
        ["--start", "0", "0", "0"],
        ["--save-state", "nowhere/state"],
        ["--save-state", "other", "--pose", "odometry"],
        ["--localize-in", "first.clf"],
    ],
)
def test_mistakes_exit_with_2(runs: Path, options: list[str], monkeypatch, capsys):
    monkeypatch.chdir(runs)
    assert mistake(main, ["second.clf", "--no-record", "--out", "never", *options], capsys)
    assert not (runs / "never").exists()
