"""Many runs: resumed, sharded, killed and summed up."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
import pytest

from experiments.config import ExperimentConfig
from experiments.summary import MEASURED
from experiments.sweep import Sweep, main, parse, sweep
from experiments.sweeping import table
from experiments.sweeping.code_version import code_version
from experiments.sweeping.groups import Naming, group
from experiments.sweeping.jobs import crashed, jobs_of
from experiments.sweeping.matrix import Matrix
from experiments.sweeping.store import RESULTS, Store
from sim.generators import BuildingConfig
from tests.experiments.commands import mistake
from tests.experiments.made_up_runs import interrupted, killed_once, quick

SHORT = ExperimentConfig(time_limit_s=2.0, building=BuildingConfig(kind="apartment", size_m=(10.0, 8.0)))


def asked(out: Path, seeds: tuple[int, int] = (0, 2), config: ExperimentConfig = SHORT, **more: Any) -> Sweep:
    axes = Matrix(kinds=("apartment",), seeds=seeds, experiment=config)
    return replace(Sweep(out=out, axes=axes), **more)


def rows_of(store: Store) -> list[dict]:
    return list(store.rows())


def unmeasured(row: dict) -> dict:
    return {key: value for key, value in row.items() if key not in (*MEASURED, "run_s", "job_s")}


def test_every_run_leaves_a_file_a_line_and_a_picture(tmp_path):
    store = sweep(asked(tmp_path))
    first, second = rows_of(store)
    assert (first["seed"], second["seed"]) == (0, 1)
    assert first["status"] == second["status"] == "time_limit"
    assert store.read(first["key"]) == first
    assert store.picture(first["key"]).startswith(b"\x89PNG")
    assert first["curve"]["seconds"][-1] == pytest.approx(first["sim_time_s"], abs=0.3)
    with (tmp_path / "table.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [line["seed"] for line in lines] == ["0", "1"]
    assert float(lines[0]["wall_error_m.p95"]) == first["wall_error_m"]["p95"]
    assert "apartment" in (tmp_path / "table.txt").read_text()


def test_a_sweep_goes_on_where_it_was(tmp_path):
    kept = rows_of(sweep(asked(tmp_path), work=quick))
    done = tmp_path / "runs" / kept[1]["key"][:2] / f"{kept[1]['key']}.json"
    done.unlink()  # as if it had been killed before this one
    before = {file: file.stat().st_mtime_ns for file in tmp_path.glob("runs/*/*.json")}
    again = rows_of(sweep(asked(tmp_path, seeds=(0, 3)), work=quick))
    assert again[:2] == kept
    assert [row["seed"] for row in again] == [0, 1, 2]
    assert all(file.stat().st_mtime_ns == when for file, when in before.items())


def test_a_killed_worker_costs_its_own_run_only(tmp_path, monkeypatch):
    (tmp_path / "been").mkdir()
    monkeypatch.setenv("MADE_UP_RUNS", str(tmp_path / "been"))
    rows = rows_of(sweep(asked(tmp_path / "sweep", (0, 5), workers=2), work=killed_once))
    assert [row["status"] for row in rows] == ["complete", "complete", "crashed", "complete", "complete"]
    assert "killed" in rows[2]["error"]


def test_what_crashed_is_tried_again_by_the_next_sweep(tmp_path):
    nowhere = replace(SHORT, start=(-99.0, 0.0, 0.0))
    (row,) = rows_of(sweep(asked(tmp_path, (0, 1), nowhere)))
    assert row["status"] == "crashed"
    assert "outside" in row["error"]
    assert json.loads((tmp_path / RESULTS).read_text()) == row
    (row,) = rows_of(sweep(asked(tmp_path, (0, 1), nowhere), work=quick))
    assert row["status"] == "complete"


def test_results_can_be_read_while_the_sweep_runs(tmp_path):
    store = Store.create(tmp_path)
    (job, other) = jobs_of(asked(tmp_path).axes, code="new")
    (old, _) = jobs_of(asked(tmp_path).axes, code="old")
    store.ask({"code": "new"})
    for done in (quick(job), quick(old), crashed(other, "oops")):
        store.write(done)
    assert sorted(row["status"] for row in rows_of(store)) == ["complete", "crashed"]


def test_what_is_found_out_later_is_added_to_the_results(tmp_path):
    store = sweep(asked(tmp_path), work=quick)
    key = rows_of(store)[0]["key"]
    store.add(key, {"competitive_ratio": 1.2})
    store.add(key, {"oracle_m": 50.0})
    found = [(row.get("competitive_ratio"), row.get("oracle_m")) for row in rows_of(store)]
    assert found == [(1.2, 50.0), (None, None)]
    sweep(asked(tmp_path), work=quick)
    assert "competitive_ratio" in (tmp_path / "table.csv").read_text()
    assert "ratio" in (tmp_path / "table.txt").read_text()


def test_shards_share_the_work_and_the_folder(tmp_path):
    for shard, runs_by_then in (("1/3", 3), ("2/3", 5), ("3/3", 7)):
        store = sweep(asked(tmp_path, (0, 7), shard=shard), work=quick)
        assert len(rows_of(store)) == runs_by_then
    assert [row["seed"] for row in rows_of(store)] == list(range(7))


def test_two_shards_that_write_a_table_at_once_do_not_meet(tmp_path):
    file, passes = tmp_path / "table.csv", []

    def rows() -> Iterator[dict]:
        passes.append(None)
        if len(passes) == 2:  # the table is half written, and another shard knows of a run more
            table.write_csv(lambda: iter([{"seed": 1}, {"seed": 2, "error": "oops"}]), file)
            yield {"seed": 2, "error": "oops"}
        yield {"seed": 1}

    table.write_csv(rows, file)
    assert file.read_text().split() == ["seed", "2", "1"]
    assert list(tmp_path.iterdir()) == [file]


def test_the_table_is_told_though_another_shard_has_just_begun(tmp_path, capsys, monkeypatch):
    def overtaken(asked: Sweep, stop: Any) -> Store:
        store = sweep(asked, stop, quick)
        store.ask({"code": code_version()})
        return store

    monkeypatch.setattr("experiments.sweep.sweep", overtaken)
    assert main(["--out", str(tmp_path), "--kinds", "maze", "--seeds", "0", "2"]) == 0
    assert "maze" in capsys.readouterr().out


def test_a_run_cut_short_is_not_kept(tmp_path):
    assert rows_of(sweep(asked(tmp_path), work=interrupted)) == []


def test_nothing_is_begun_once_somebody_wants_to_stop(tmp_path):
    assert rows_of(sweep(asked(tmp_path), stop=lambda: True, work=quick)) == []


def test_ctrl_c_keeps_what_is_done_and_leaves_nobody_behind(tmp_path):
    command = [sys.executable, "-m", "experiments.sweep", "--out", str(tmp_path), "--kinds", "maze"]
    small = ["--sizes", "4", "4", "--seeds", "0", "500", "--time-limit-s", "2"]
    process = subprocess.Popen([*command, *small], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    while process.poll() is None and not list(tmp_path.glob("runs/*/*.json")):
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGINT)
    printed, said = process.communicate(timeout=60.0)
    assert process.returncode == 128 + signal.SIGINT
    assert "Traceback" not in said
    assert "maze" in printed
    done = rows_of(Store(tmp_path))
    assert 0 < len(done) < 500
    assert {row["status"] for row in done} <= {"time_limit", "complete"}


def test_the_worst_runs_are_recorded_and_named_in_the_results(tmp_path):
    rows = rows_of(sweep(asked(tmp_path, keep_recordings="worst:1")))
    (recorded,) = [row for row in rows if "recording" in row]
    folder = tmp_path / recorded["recording"]
    assert (folder / "recording.rrd").stat().st_size > 1000
    again = json.loads((folder / "summary.json").read_text())
    assert {name: recorded[name] for name in again if name not in MEASURED} == {
        name: value for name, value in again.items() if name not in MEASURED
    }


def test_two_sweeps_of_one_matrix_agree(tmp_path):
    one, other = (rows_of(sweep(asked(tmp_path / name, (0, 1)))) for name in "ab")
    assert [unmeasured(row) for row in one] == [unmeasured(row) for row in other]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--workers", "0"], "workers"),
        (["--seeds", "3", "3"], "seeds"),
        (["--shard", "4/3"], "shard"),
        (["--keep-recordings", "some"], "keep_recordings"),
        (["--vary", "lidar.beems=3"], "beems"),
        (["--vary", "noise_scale=1,2", "--noise-scales", "1"], "twice"),
        (["--kinds", "office", "--sizes", "1", "1"], "at least"),
        (["--seed", "3"], "give seeds instead"),
        (["--plans", "nowhere.yaml"], "nowhere.yaml"),
        (["--plan-resolution-m", "0.05"], "give the --plans too"),
        (["--matrix", "nowhere.toml"], "nowhere.toml"),
        (["--scheduler", "tcp://127.0.0.1:1"], "scheduler"),
    ],
)
def test_a_mistake_is_named_before_anything_runs(tmp_path, capsys, monkeypatch, options, complaint):
    monkeypatch.setattr("experiments.sweeping.cluster.CONNECT_S", 0.5)
    assert complaint in mistake(main, ["--out", str(tmp_path / "sweep"), *options], capsys)
    assert not list(tmp_path.glob("sweep/runs/*/*"))


def test_a_mistake_in_a_plan_is_named_before_anything_runs(tmp_path, capsys):
    for name, text in (("fine", "image: plan.png\nresolution: 0.05\norigin: [0, 0, 0]\n"), ("broken", "{")):
        (tmp_path / f"{name}.yaml").write_text(text)
    imageio.imwrite(tmp_path / "plan.png", np.full((40, 40), 255, np.uint8))
    plans = [str(tmp_path / name) for name in ("fine.yaml", "broken.yaml")]
    assert "broken.yaml" in mistake(main, ["--out", str(tmp_path / "sweep"), "--plans", *plans], capsys)
    assert not (tmp_path / "sweep").exists()


def test_an_image_is_a_plan_too(tmp_path, capsys):
    """How large its pixels are is said once for all runs; without that it is a mistake like any other."""
    imageio.imwrite(tmp_path / "plan.png", np.full((40, 40), 255, np.uint8))
    options = ["--out", str(tmp_path / "sweep"), "--plans", str(tmp_path / "plan.png"), "--seeds", "0", "2"]
    assert "how many metres a pixel is wide" in mistake(main, options, capsys)
    axes = parse([*options, "--plan-resolution-m", "0.05"]).axes
    rows = rows_of(sweep(Sweep(tmp_path / "sweep", axes=axes), work=quick))
    assert [(row["name"], row["config"]["plan_resolution_m"]) for row in rows] == 2 * [("plan", 0.05)]


def test_the_first_crash_is_told(tmp_path, capsys):
    sweep(asked(tmp_path, (0, 2), replace(SHORT, start=(-99.0, 0.0, 0.0))))
    said = capsys.readouterr().err
    assert "2 crashed, the first: apartment 0: ValueError" in said
    assert "outside" in said


def test_results_of_another_kind_are_not_written_over(tmp_path):
    (tmp_path / RESULTS).write_text("{}\n")
    with pytest.raises(ValueError, match="choose another"):
        sweep(asked(tmp_path), work=quick)


def test_the_table_tells_strategies_apart_and_names_failures():
    matrix = Matrix(kinds=("maze", "office"), seeds=(0, 1), strategies=("nearest", "utility"))
    rows = [quick(job).row for job in jobs_of(matrix, code="")]
    rows.append({"key": "", "name": "hall", "status": "crashed", "error": "oops"})
    text = table.text_table(group(rows, Naming.of(rows)))
    assert [line.split()[:2] for line in text.splitlines()[1:]] == [
        ["hall", "1"],
        ["maze", "nearest"],
        ["maze", "utility"],
        ["office", "nearest"],
        ["office", "utility"],
    ]
    assert "all crashed" in text
    assert "99.80%" in text
    assert "ratio" not in text


def test_groups_are_named_by_what_tells_them_apart_and_no_more():
    matrix = Matrix(kinds=("maze",), seeds=(0, 1), noise_scales=(0.5, 2.0))
    rows = [quick(job).row for job in jobs_of(matrix, code="")]
    for row in rows:  # the drift follows from the noise: it says nothing
        row["options"]["drift_scale"] = row["options"]["noise_scale"]
    naming = Naming.of(rows)
    assert [naming.series(row) for row in rows] == ["tour, noise 0.5", "tour, noise 2"]


def test_many_plans_are_one_group():
    plans = [{"name": f"plan {n}", "is_plan": True, "status": "crashed", "error": ""} for n in range(12)]
    assert [group.kind for group in group(plans, Naming.of(plans))] == ["plans"]
    assert len(group(plans[:3], Naming.of(plans[:3]))) == 3


def test_a_competitive_ratio_has_its_column_where_there_is_one():
    (job,) = jobs_of(Matrix(kinds=("maze",), seeds=(0, 1)), code="")
    rows = [quick(job).row | {"competitive_ratio": 1.234}]
    assert "1.234" in table.text_table(group(rows, Naming.of(rows)))
