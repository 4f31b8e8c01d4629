"""Replaying a piece of a real log, and made-up ones."""

import json
from pathlib import Path

import numpy as np
import pytest

from experiments.logs.log import read_log
from experiments.replay import main
from experiments.replaying.localizers import MotionFilter, RememberedOdometry
from experiments.replaying.runner import ReplayConfig, free_no_returns, hits_alone, no_returns_alone, replay
from experiments.tum_file import read_tum
from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.map_server import load_map
from occmap.scan import Observation, Scan
from tests.experiments.commands import mistake

DATA = Path(__file__).parent.parent / "data"
LOG, RELATIONS = DATA / "intel_part.clf.gz", DATA / "intel_part.relations"


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The log replayed with each source of poses, one of them recorded."""
    out = tmp_path_factory.mktemp("replays")
    for pose, record in (("odometry", "--no-record"), ("slam", "--record")):
        arguments = [
            str(LOG),
            "--relations",
            str(RELATIONS),
            "--out",
            str(out / pose),
            "--pose",
            pose,
            record,
        ]
        assert main(arguments) == 0
    return {pose: out / pose for pose in ("odometry", "slam")}


def test_slam_meets_the_benchmark_where_odometry_does_not(folders: dict[str, Path]):
    scores = {pose: json.loads((folder / "summary.json").read_text()) for pose, folder in folders.items()}
    assert scores["odometry"]["relations"]["rotation_deg"]["mean"] > 1.0
    assert scores["slam"]["relations"]["rotation_deg"]["mean"] < 0.453
    assert scores["slam"]["relations"]["translation_m"]["mean"] < 0.0229
    assert scores["slam"]["relations"]["relations"] == 58


def test_the_folder_holds_what_the_readme_promises(folders: dict[str, Path]):
    names = {"map.yaml", "map.pgm", "trajectory.tum", "laser.tum", "summary.json"}
    assert {path.name for path in folders["odometry"].iterdir()} == names
    assert {path.name for path in folders["slam"].iterdir()} == names | {"recording.rrd"}
    for folder in folders.values():
        state = load_map(folder / "map.yaml").state
        assert (state == Belief.FREE).sum() * 0.05**2 > 100.0
        assert (state == Belief.OCCUPIED).sum() > 500


def test_one_pose_a_scan_at_the_log_s_own_stamps(folders: dict[str, Path]):
    log = read_log(LOG)
    times_s = sorted(seen.time_s for seen in log.observations)
    for folder in folders.values():
        for name in ("trajectory.tum", "laser.tum"):
            np.testing.assert_array_equal(read_tum(folder / name).times_s, times_s)
    summary = json.loads((folders["slam"] / "summary.json").read_text())
    assert summary["scans"] == 400
    assert summary["status"] == "complete"
    assert summary["skipped"] == {"count": 0, "first": []}


def test_the_map_frame_is_the_robot_s_first_pose(folders: dict[str, Path]):
    for folder in folders.values():
        np.testing.assert_allclose(read_tum(folder / "trajectory.tum").poses[0], 0.0, atol=1e-6)


def test_the_same_log_twice_is_the_same_trajectory_bit_by_bit():
    log = read_log(LOG)
    first, second = (replay(log, ReplayConfig()) for _ in range(2))
    np.testing.assert_array_equal(first.robot.poses, second.robot.poses)
    np.testing.assert_array_equal(first.grid.state, second.grid.state)


def test_the_trajectory_is_sorted_by_stamp_whatever_the_log_is(tmp_path: Path):
    stamps = [0.0, 1.0, 3.0, 2.0, 5.0, 4.0, 6.0]
    lines = [f"FLASER 3 1 {9 - k} 1 {k} 0 0 {k} 0 0 {t} host 1" for k, t in enumerate(stamps)]
    (tmp_path / "some.log").write_text("\n".join(lines))
    replayed = replay(read_log(tmp_path / "some.log"), ReplayConfig(pose="odometry"))
    np.testing.assert_array_equal(replayed.laser.times_s, sorted(stamps))
    np.testing.assert_array_equal(replayed.laser.poses[:, 0], [0, 1, 3, 2, 5, 4, 6])
    assert replayed.path_length_m == 6.0


def test_what_an_earlier_replay_wrote_is_not_overwritten(folders: dict[str, Path], capsys):
    before = (folders["odometry"] / "summary.json").read_bytes()
    assert main([str(LOG), "--out", str(folders["odometry"]), "--no-record"]) == 2
    assert "holds a run already" in capsys.readouterr().err
    assert (folders["odometry"] / "summary.json").read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["none.log"],
        ["."],
        ["empty.log"],
        [str(LOG), "--relations", "none.relations"],
        [str(LOG), "--relations", "empty.log"],
        [str(LOG), "--no-return-frees-m", "-1"],
        [str(LOG), "--no-return-frees-m", "nan"],
        [str(LOG), "--map.resolution-m", "0"],
        [str(LOG), "--pose", "truth"],
        [str(LOG), "--nonsense"],
    ],
)
def test_mistakes_exit_with_2_and_a_word_of_why(tmp_path: Path, arguments, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.log").write_text("# nothing here\n")
    assert mistake(main, arguments, capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["empty.log"]


def test_broken_lines_are_reported_and_the_rest_is_mapped(tmp_path: Path, capsys):
    lines = [f"FLASER 3 1.0 {1 + t / 100:.2f} 1.0 {t / 50} 0 0 {t / 50} 0 0 {t} host {t}" for t in range(10)]
    lines.insert(4, "FLASER 3 1.0 oops")
    (tmp_path / "some.log").write_text("\n".join(lines))
    arguments = [
        str(tmp_path / "some.log"),
        "--out",
        str(tmp_path / "out"),
        "--no-record",
        "--pose",
        "odometry",
    ]
    assert main(arguments) == 0
    err = capsys.readouterr().err
    assert "1 broken" in err
    assert "5: FLASER" in err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["skipped"]["count"] == 1
    assert summary["skipped"]["first"][0]["number"] == 5
    assert summary["scans"] == 10


def test_a_single_scan_is_a_log_too(tmp_path: Path):
    (tmp_path / "one.log").write_text("FLASER 3 1.0 1.0 1.0 7 8 1 7 8 1 5.0 host 1\n")
    assert main([str(tmp_path / "one.log"), "--out", str(tmp_path / "out"), "--no-record"]) == 0
    assert len(read_tum(tmp_path / "out" / "trajectory.tum")) == 1


def test_a_no_return_frees_nothing_unless_told_how_far():
    bearings = np.array([0.0, np.pi / 2])
    scan = Scan(bearings, np.array([2.0, np.inf]), 50.0)
    np.testing.assert_array_equal(hits_alone(scan).ranges_m, [2.0, np.nan])
    alone = no_returns_alone(scan, 3.0)
    assert alone.max_range_m == 3.0
    np.testing.assert_array_equal(alone.ranges_m, [np.nan, np.inf])

    grid = OccupancyGrid()
    seen = (Observation(0.0, Pose2.identity(), scan, Pose2.identity()),)
    free_no_returns(grid, seen, [Pose2.identity()], 3.0)
    for y_m, log_odds in ((2.5, -0.4), (3.5, 0.0)):
        ix, iy = grid.frame.cell_at(0.01, y_m)
        value = grid.log_odds[iy, ix] if grid.contains(ix, iy) else 0.0
        assert value == pytest.approx(log_odds)
    assert not grid.contains(*grid.frame.cell_at(2.0, 0.0)), "the hit was not spent"


def on_the_spot(range_m: float) -> list[Observation]:
    """Two scans of a robot that turns to the left, of one beam cast ahead as it began to turn."""
    scan = Scan(np.zeros(1), np.array([range_m]), 50.0, beam_times_s=np.array([-0.2]))
    ahead, turned = Pose2.identity(), Pose2(0.0, 0.0, 0.5)
    return [Observation(0.2 * k, pose, scan, Pose2.identity()) for k, pose in enumerate((ahead, turned))]


def test_the_wheels_own_map_is_of_beams_cast_on_the_move():
    localizer = RememberedOdometry(GridConfig())
    for seen in on_the_spot(2.02):
        localizer.update(seen)
    grid = localizer.map()
    assert np.count_nonzero(grid.hits) == 1
    ix, iy = grid.frame.cell_at(2.02, 0.0)
    assert grid.hits[iy, ix] == 2


def test_so_is_what_no_returns_free():
    grid, seen = OccupancyGrid(), on_the_spot(np.inf)
    free_no_returns(grid, seen, [each.odom_from_robot for each in seen], 3.0)
    iy, _ = np.nonzero(grid.log_odds)
    assert np.ptp(iy) <= 1


def test_a_robot_that_stands_tells_nothing_new():
    motion = MotionFilter(every_m=0.1, every_rad=0.1)
    poses = [Pose2(0, 0, 0), Pose2(0.05, 0, 0), Pose2(0.11, 0, 0), Pose2(0.11, 0, 0.05), Pose2(0.11, 0, 0.12)]
    assert [motion.is_due(pose) for pose in poses] == [True, False, True, False, True]
