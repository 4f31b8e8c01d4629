"""Many runs: resumed, robust and summed up."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from experiments import sweep as sweeping
from experiments.config import ExperimentConfig
from experiments.summary import MEASURED
from experiments.sweep import RESULTS, Sweep, key_of, read, sweep, table
from sim.generators import BuildingConfig

SHORT = ExperimentConfig(time_limit_s=2.0, building=BuildingConfig(kind="apartment", size_m=(10.0, 8.0)))


def job(out: Path, seeds: tuple[int, int] = (0, 2), **changes: object) -> Sweep:
    return replace(Sweep(out=out, kinds=("apartment",), seeds=seeds, experiment=SHORT), **changes)


def unmeasured(row: dict) -> dict:
    return {key: value for key, value in row.items() if key not in MEASURED}


def test_every_run_leaves_a_line_and_none_is_run_twice(tmp_path, monkeypatch):
    rows = sweep(job(tmp_path))
    assert [row["seed"] for row in rows] == [0, 1]
    assert [row["status"] for row in rows] == ["time_limit", "time_limit"]

    started: list[int] = []
    original = sweeping.results

    def counted(configs, workers):
        started.extend(config.seed for config in configs)
        yield from original(configs, workers)

    monkeypatch.setattr(sweeping, "results", counted)
    assert sweep(job(tmp_path, seeds=(0, 3)))[:2] == rows
    assert started == [2]


def test_a_line_cut_short_is_run_again(tmp_path):
    rows = sweep(job(tmp_path))
    file = tmp_path / RESULTS
    file.write_text(file.read_text()[:-20])
    again = sweep(job(tmp_path))
    assert [unmeasured(row) for row in again] == [unmeasured(row) for row in rows]
    assert len(list(read(file))) == 2


def test_a_run_that_cannot_be_is_a_row_too(tmp_path):
    nowhere = replace(SHORT, start=(-99.0, 0.0, 0.0))
    (row,) = sweep(job(tmp_path, seeds=(0, 1), experiment=nowhere))
    assert row["status"] == "crashed"
    assert "outside" in row["error"]
    assert json.loads((tmp_path / RESULTS).read_text()) == row


def test_a_run_is_known_by_all_that_decides_it():
    assert key_of(SHORT) == key_of(replace(SHORT))
    assert key_of(SHORT) != key_of(replace(SHORT, seed=1))
    assert key_of(SHORT) != key_of(replace(SHORT, noise_scale=2.0))


@pytest.mark.parametrize(
    ("changes", "complaint"), [({"workers": 0}, "workers"), ({"seeds": (3, 3)}, "seeds")]
)
def test_a_sweep_of_nothing_is_refused(tmp_path, changes, complaint):
    with pytest.raises(ValueError, match=complaint):
        job(tmp_path, **changes)


def test_the_table_names_every_kind_and_its_failures():
    good = {
        "name": "maze",
        "status": "complete",
        "honest": True,
        "explored": 0.998,
        "wrong": 0.0004,
        "wall_recall": 0.99,
        "wall_error_m": {"mean": 0.01, "p95": 0.05},
        "collisions": {"events": 0, "duration_s": 0.0},
        "path_length_m": 123.4,
        "real_time_factor": 101.0,
    }
    text = table([good, {"name": "office", "status": "crashed", "error": "oops"}])
    assert "99.80%" in text
    assert "123" in text
    assert "all crashed" in text
