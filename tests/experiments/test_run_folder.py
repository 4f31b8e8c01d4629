"""Nothing that an earlier run wrote is overwritten."""

from pathlib import Path

import pytest

from experiments.run_folder import RunFolder


def test_a_folder_that_holds_a_run_is_refused_with_a_way_out(tmp_path):
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(ValueError, match=r"holds a run already \(summary.json\).*choose another"):
        RunFolder.create(tmp_path)


def test_a_floor_plan_is_not_overwritten_by_the_map_of_it(tmp_path):
    (tmp_path / "map.pgm").write_bytes(b"the image that house.yaml names")
    with pytest.raises(ValueError, match=r"holds a run already \(map.pgm\).*choose another"):
        RunFolder.create(tmp_path)


def test_a_folder_of_other_things_will_do(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    assert RunFolder.create(tmp_path).path == tmp_path


def test_missing_folders_are_made(tmp_path):
    assert RunFolder.create(tmp_path / "a" / "b").path.is_dir()


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_place_that_cannot_be_a_folder_is_refused(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="cannot write to --out"):
        RunFolder.create(tmp_path / name)


def test_named_folders_are_unique(tmp_path):
    names = [RunFolder.create_named(tmp_path / "runs", "office-1").path.name for _ in range(3)]
    assert names == ["office-1", "office-1-2", "office-1-3"]


@pytest.mark.parametrize("name", ["../../x", "/x", "a/b", "..", ".hidden", "plan: 2nd floor"])
def test_a_plan_may_bear_any_name(tmp_path, name):
    for _ in range(2):
        made = RunFolder.create_named(tmp_path / "runs", name).path
        assert made.parent == tmp_path / "runs"
        assert made.is_dir()
        assert not made.name.startswith(".")


def test_runs_that_cannot_be_kept_are_refused(tmp_path):
    (tmp_path / "runs").write_text("")
    with pytest.raises(ValueError, match="cannot write to"):
        RunFolder.create_named(tmp_path / "runs", "office-1")


def test_the_folder_divides_like_a_path(tmp_path):
    assert RunFolder(tmp_path) / "a.txt" == Path(tmp_path) / "a.txt"
