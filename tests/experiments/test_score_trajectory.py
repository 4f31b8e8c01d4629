"""The command that scores a trajectory file."""

from pathlib import Path

import pytest

from experiments.score_trajectory import main
from experiments.tum_file import Trajectory, write_tum
from occmap.geometry import Pose2
from tests.experiments.commands import mistake


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    times_s = [1.0, 2.0, 3.0]
    write_tum(tmp_path / "true.tum", Trajectory.of(times_s, [Pose2(k, 0.0, 0.0) for k in range(3)]))
    write_tum(tmp_path / "laser.tum", Trajectory.of(times_s, [Pose2(1.1 * k, 0.0, 0.0) for k in range(3)]))
    (tmp_path / "true.relations").write_text(
        "1.0 2.0 1 0 0 0 0 0\n1.0 3.0 2 0 0 0 0 0\n2.0 9.0 2 0 0 0 0 0\n"
    )
    return tmp_path


def test_relations_are_reported_as_in_the_benchmark(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert main([str(folder / "laser.tum"), "--relations", str(folder / "true.relations")]) == 0
    out = capsys.readouterr().out
    assert "2 relations, 1 more have no pose" in out
    assert "translation  0.1500 ± 0.0500 m, max 0.2000 m" in out


def test_a_reference_gives_ate_and_rpe(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert main([str(folder / "laser.tum"), "--reference", str(folder / "true.tum")]) == 0
    out = capsys.readouterr().out
    assert "ATE  rmse 0.129099 m" in out
    assert "RPE over 1 frames  rmse 0.100000 m" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ["laser.tum"],
        ["none.tum", "--reference", "true.tum"],
        ["laser.tum", "--relations", "none.relations"],
        ["laser.tum", "--reference", "true.relations"],
        ["laser.tum", "--reference", "true.tum", "--rpe-delta", "0"],
    ],
)
def test_mistakes_exit_with_2_and_a_word_of_why(folder: Path, arguments, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert mistake(main, arguments, capsys)
