"""Which of two sweeps is better, and the gate that stops the worse one."""

from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.compare import main, reservations
from experiments.comparison import Tolerance, bootstrap, compare
from experiments.pairing import pair
from experiments.sweep import Sweep, sweep
from experiments.sweeping.jobs import jobs_of
from experiments.sweeping.matrix import Matrix
from tests.experiments.commands import mistake
from tests.experiments.made_up_runs import failing, longer, quick

AXES = Matrix(kinds=("maze", "hall"), seeds=(0, 8))


def swept(out: Path, work: Any = quick, axes: Matrix = AXES) -> str:
    return str(sweep(Sweep(out=out, axes=axes), work=work).folder)


def rows(work: Any = quick, axes: Matrix = AXES) -> list[dict]:
    return [work(job).row for job in jobs_of(axes, code="")]


def test_the_worse_sweep_is_stopped_and_the_better_one_is_not(tmp_path, capsys):
    short, long = swept(tmp_path / "short"), swept(tmp_path / "long", longer)
    assert main([short, long]) == 1
    assert "B is worse (all): it drives 10.9% more" in capsys.readouterr().out
    assert main([long, short]) == 0
    assert "B is better: it drives 9.8% less" in capsys.readouterr().out
    assert main([short, short]) == 0
    assert "1.000 [1.000, 1.000]" in capsys.readouterr().out


def test_what_is_tolerated_does_not_stop_it(tmp_path):
    short, long = swept(tmp_path / "short"), swept(tmp_path / "long", longer)
    assert main([short, long, "--tolerance.metres", "0.15"]) == 0


def test_a_failure_that_was_none_before_stops_it(tmp_path, capsys):
    good, bad = swept(tmp_path / "good"), swept(tmp_path / "bad", failing)
    assert main([good, bad]) == 1
    assert "it fails where A did not 2 times" in capsys.readouterr().out
    assert main([good, bad, "--tolerance.failures", "2"]) == 0


def test_strategies_of_one_sweep_compare(tmp_path, capsys):
    both = swept(tmp_path, axes=replace(AXES, strategies=("nearest", "utility")))
    assert main([both, both, "--where-a", "strategy=nearest", "--where-b", "strategy=utility"]) == 0
    assert "all       16" in capsys.readouterr().out
    assert main([both, both, "--where-a", "strategy=nearest", "--where-b", "name=maze"]) == 0
    assert "left out: 8 runs that only A has, 8 that only B has" in capsys.readouterr().out


def test_a_sweep_that_was_run_in_parts_counts_whole(tmp_path, capsys):
    swept(tmp_path / "b", axes=AXES)
    for seeds in ((0, 3), (3, 8)):
        swept(tmp_path / "a", axes=replace(AXES, seeds=seeds))
    assert main([str(tmp_path / "a"), str(tmp_path / "b")]) == 0
    said = capsys.readouterr().out
    assert "all       16" in said
    assert "left out" not in said


def test_parts_may_be_strategies(tmp_path, capsys):
    for strategy in ("nearest", "utility"):
        folder = swept(tmp_path, axes=replace(AXES, strategies=(strategy,)))
    assert main([folder, folder, "--where-a", "strategy=nearest", "--where-b", "strategy=utility"]) == 0
    assert "all       16" in capsys.readouterr().out


def test_another_experiment_in_the_folder_is_no_part(tmp_path, capsys):
    short = replace(AXES, experiment=replace(AXES.experiment, time_limit_s=5.0))
    swept(tmp_path / "a", longer, short)
    swept(tmp_path / "a")
    assert main([str(tmp_path / "a"), swept(tmp_path / "b")]) == 0
    assert "1.000 [1.000, 1.000]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--where-a", "stratgy=nearest"], "stratgy"),
        (["--where-a", "nearest"], "NAME=VALUE"),
        (["--where-a", "seed=1", "--where-b", "seed=2"], "nothing to compare"),
        (["--tolerance.metres", "-1"], "tolerance"),
        (["--seed", "-1"], "seed must not be negative"),
    ],
)
def test_a_mistake_is_named(tmp_path, capsys, options, complaint):
    folder = swept(tmp_path)
    assert complaint in mistake(main, [folder, folder, *options], capsys)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("results.jsonl", '{"name": "maze", "seed": 1, "status": "complete"}'),
        ("results.jsonl", '{"key": "3fa2", "name": "maze", "status": "complete"}'),
        ("results.jsonl", '{"key": "3fa2", "name": "maze", "seed": 1}'),
        ("results.jsonl", "[1]"),
        ("results.jsonl", "3"),
        ("results.jsonl", "{"),
        ("sweep.json", "{}"),
        ("sweep.json", "[]"),
        ("runs/3f/3fa2.json", ""),
        ("runs/3f/3fa2.json", "{}"),
    ],
)
def test_a_file_that_no_sweep_wrote_is_named(tmp_path, capsys, name, text):
    file = tmp_path / name
    (tmp_path / "sweep.json").write_text('{"code": "1"}')
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    assert str(file) in mistake(main, [str(tmp_path), str(tmp_path)], capsys)


def test_a_folder_that_holds_no_sweep_is_named(tmp_path, capsys):
    assert main([str(tmp_path), str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err


def test_partners_agree_on_all_that_varies_on_either_side():
    noisy = rows(axes=replace(AXES, noise_scales=(1.0, 2.0)))
    pairing = pair(noisy, rows())
    assert (len(pairing.pairs), pairing.only_a, pairing.only_b) == (16, 16, 0)
    assert pairing.told_apart_by == ("noise_scale",)


def test_a_seed_that_made_another_building_is_left_out():
    before, after = rows(), rows()
    for row in (*before, *after):
        row["building"] = {"rooms": 4, "free_area_m2": 60.0}
    after[0]["building"] = {"rooms": 5, "free_area_m2": 60.0}
    after[1]["building"] = {"rooms": 4, "free_area_m2": 60.1}  # seen at another resolution
    pairing = pair(before, after)
    assert (len(pairing.pairs), pairing.differing) == (15, 1)


def test_a_run_with_two_partners_is_refused():
    with pytest.raises(ValueError, match="two runs"):
        pair(rows() + rows(), rows())


def test_metres_count_only_where_both_came_to_the_end():
    (hall, maze, overall) = compare(pair(rows(), rows(failing)))
    assert (hall.kind, maze.kind, overall.kind) == ("hall", "maze", "all")
    assert overall.metres is not None
    assert overall.metres.value == pytest.approx(1.0)
    assert (overall.lost, overall.won) == (2, 0)
    assert overall.explored.value == pytest.approx((0.5 - 0.998) * 2 / 16)


def test_pairs_that_share_building_and_seed_count_as_one():
    noisy = replace(AXES, noise_scales=(1.0, 2.0, 4.0))
    (*_, once) = compare(pair(rows(), rows(longer)))
    (*_, thrice) = compare(pair(rows(axes=noisy), rows(longer, noisy)))
    assert (once.pairs, thrice.pairs) == (16, 48)
    for one, other in ((once.metres, thrice.metres), (once.explored, thrice.explored)):
        assert astuple(one) == pytest.approx(astuple(other))


def test_few_buildings_are_a_reservation_however_many_pairs_there_are():
    few = rows(axes=replace(AXES, seeds=(0, 2), noise_scales=(1.0, 2.0, 4.0)))
    assert reservations(pair(few, few)) == ["only 4 buildings: so few make the intervals too narrow"]
    assert not reservations(pair(rows(), rows()))


def test_what_crashed_is_worse():
    crashed = [row | {"status": "crashed", "error": "oops"} for row in rows()]
    (*_, overall) = compare(pair(rows(), crashed))
    assert overall.metres is None
    assert Tolerance().complaints(overall)


def test_many_plans_are_one_kind():
    plans = [row | {"name": f"plan {n}", "is_plan": True} for n, row in enumerate(rows())]
    (together,) = compare(pair(plans, plans))
    assert (together.kind, together.pairs) == ("plans", 16)


def test_the_interval_holds_the_mean_19_times_in_20():
    rng = np.random.default_rng(0)
    hits = 0
    for seed in range(40):
        interval = bootstrap(rng.normal(0.3, 1.0, 40), seed)
        assert interval.low <= interval.value <= interval.high
        hits += interval.low <= 0.3 <= interval.high
    assert 34 <= hits <= 40


def test_the_same_seed_gives_the_same_interval():
    values = np.arange(9.0)
    assert bootstrap(values, 1) == bootstrap(values, 1) != bootstrap(values, 2)


@pytest.mark.parametrize("share", [0.01, 0.05, 0.15])
def test_what_is_worse_by_just_as_much_as_is_tolerated_is_tolerated(share):
    less = [row | {"explored": row["explored"] - share} for row in rows()]
    (*_, overall) = compare(pair(rows(), less))
    assert Tolerance(explored=share).complaints(overall) == []
    assert Tolerance(explored=0.99 * share).complaints(overall)
