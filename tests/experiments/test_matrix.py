"""Which runs a sweep consists of, and what each is known by."""

from dataclasses import replace
from itertools import islice
from typing import get_args

import pytest

from experiments import config_file
from experiments.config import ExperimentConfig
from experiments.sweep import parse
from experiments.sweeping import code_version
from experiments.sweeping.code_version import sources
from experiments.sweeping.jobs import Job, content_hash, jobs_of
from experiments.sweeping.matrix import Matrix, axis_of
from experiments.sweeping.matrix_file import read_matrix
from sim.generators import BuildingConfig, Kind

SAME = ExperimentConfig()

TOML = """
seeds = [3, 5]
kinds = ["office", "hall"]
strategies = ["nearest", "utility"]
noise_scales = [1, 2.0]

[experiment]
pose = "slam"
lidar.max_range_m = 20

[vary]
"explorer.goals.lambda_m_per_m2" = [0.5, 2]
"""
YAML = """
seeds: [3, 5]
kinds: [office, hall]
strategies: [nearest, utility]
noise_scales: [1, 2.0]
experiment: {pose: slam, lidar: {max_range_m: 20}}
vary: {explorer.goals.lambda_m_per_m2: [0.5, 2]}
"""


def test_every_combination_is_a_run_and_all_are_counted():
    matrix = Matrix(
        kinds=("office", "maze"),
        sizes=((12.0, 10.0), (20.0, 20.0)),
        seeds=(5, 8),
        strategies=("nearest", "utility"),
        vary=("lidar.beams=180,360",),
    )
    keys = {job.key for job in jobs_of(matrix, code="")}
    assert len(keys) == len(matrix) == 2 * 2 * 3 * 2 * 2
    assert {config.seed for config in matrix.experiments()} == {5, 6, 7}
    assert {config.lidar.beams for config in matrix.experiments()} == {180, 360}


def test_nothing_but_what_is_taken_is_made():
    endless = Matrix(kinds=("maze",), seeds=(0, 10**15))
    assert len(endless) == 10**15
    assert [job.config.seed for job in islice(jobs_of(endless, code=""), 3)] == [0, 1, 2]


def test_all_kinds_that_there_are_are_swept_by_default():
    assert {config.building.kind for config in Matrix(seeds=(0, 1)).experiments()} == set(get_args(Kind))


@pytest.mark.parametrize(("name", "text"), [("m.toml", TOML), ("m.yaml", YAML)])
def test_a_file_says_the_same_as_options_and_options_win(tmp_path, name, text):
    file = tmp_path / name
    file.write_text(text)
    matrix = read_matrix(file)
    assert len(matrix) == 2 * 2 * 2 * 2 * 2
    (first, *_) = matrix.experiments()
    assert (first.seed, first.pose, first.lidar.max_range_m) == (3, "slam", 20.0)
    said = parse(["--matrix", str(file), "--kinds", "maze", "--noise-scales", "1"])
    assert len(said.axes) == 2 * 2 * 2
    assert said.axes.experiment.pose == "slam"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("kinds = 3", "list"),
        ('kinds = ["castle"]', "castle"),
        ("[vary]\nnoise_scale = 3", "vary"),
        ("[experiment]\nbeams = 3", "beams"),
        ("kinds = [", "TOML"),
        ("[experiment]\nseed = 3", "give seeds instead"),
        ('[experiment]\nplan = "house.yaml"', "give plans instead"),
        ('[experiment.building]\nkind = "maze"', "give kinds instead"),
        ("[vary]\nnoise_scale = [2020-01-01]", "noise_scale"),
    ],
)
def test_a_file_that_is_none_is_named(tmp_path, text, complaint):
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(ValueError, match=complaint):
        len(read_matrix(file))


@pytest.mark.parametrize(
    ("options", "axis"),
    [(["--seed", "0"], "seeds"), (["--plan", "house.yaml"], "plans"), (["--building.kind=office"], "kinds")],
)
def test_options_that_are_axes_of_every_sweep_are_mistakes(options, axis):
    with pytest.raises(ValueError, match=f"give {axis} instead"):
        parse(["--kinds", "maze", *options])


@pytest.mark.parametrize("option", ["--kinds office", "--building.size-m 9 9"])
def test_generated_buildings_are_not_asked_for_beside_plans(tmp_path, option):
    (tmp_path / "house.yaml").write_text("")
    with pytest.raises(ValueError, match=f"{option.split()[0]} .*does not go with --plans"):
        parse(["--plans", str(tmp_path / "house.yaml"), *option.split()])


@pytest.mark.parametrize("option", ["--vary lidar.beams=180,360", "--noise-scales 0.5 2"])
def test_an_option_that_takes_many_values_is_there_once(option):
    """Else the first are left out of the sweep, and nobody is told."""
    with pytest.raises(ValueError, match=f"{option.split()[0]} is given twice"):
        parse([*option.split(), *option.split()])


def test_what_the_experiment_and_the_axis_agree_on_is_no_mistake():
    mazes = replace(SAME, building=BuildingConfig(kind="maze"))
    assert len(Matrix(kinds=("maze",), seeds=(0, 2), experiment=mazes)) == 2


def test_an_axis_with_a_value_twice_is_a_mistake():
    for matrix in (Matrix(strategies=("utility", "utility")), Matrix(vary=("lidar.beams=180,360,180",))):
        with pytest.raises(ValueError, match=r"takes (utility|180) twice"):
            len(matrix)


def test_plans_in_a_file_lie_beside_it(tmp_path):
    (tmp_path / "house.yaml").write_text("")
    (tmp_path / "m.toml").write_text('plans = ["house.yaml"]')
    assert read_matrix(tmp_path / "m.toml").plans == (tmp_path / "house.yaml",)


def test_varied_values_are_written_as_in_yaml():
    assert axis_of("lidar.beams=180, 360").values == (180, 360)
    assert axis_of("noise_scale=1e-3,2.5E1").values == (0.001, 25.0)
    assert axis_of("explorer.goals.gain=raycast,size").values == ("raycast", "size")
    assert axis_of("building.size_m=[30, 20],[12, 10]").values == ((30.0, 20.0), (12.0, 10.0))


def test_a_run_is_known_by_all_that_decides_it(tmp_path):
    def key(config: ExperimentConfig, code: str = "1") -> str:
        return Job(config, code).key

    seeded = replace(SAME, building=BuildingConfig(seed=SAME.building_seed))
    assert key(SAME) == key(replace(SAME)) == key(seeded)
    assert key(SAME) != key(replace(SAME, seed=1))
    assert key(SAME) != key(replace(SAME, noise_scale=2.0))
    assert key(SAME) != key(SAME, code="2")


def test_a_result_tells_how_to_run_it_again(tmp_path):
    unusual = replace(SAME, seed=3, pose="odometry", lidar=replace(SAME.lidar, beams=180))
    said = Job(unusual, "").identity()["config"]
    assert said == {
        "seed": 3,
        "pose": "odometry",
        "lidar": {"beams": 180},
        "building": {"seed": unusual.building_seed},
    }
    assert config_file.from_plain(ExperimentConfig, said, where="row") == unusual.pinned()


def test_a_plan_is_known_by_its_contents_not_by_its_place(tmp_path):
    here, there = tmp_path / "a.png", tmp_path / "b.png"
    here.write_bytes(b"walls")
    there.write_bytes(b"walls")
    keys = [Job(replace(SAME, plan=plan), "").key for plan in (here, there)]
    assert keys[0] == keys[1]
    there.write_bytes(b"other walls")
    assert Job(replace(SAME, plan=there), "").key != keys[0]


def test_a_plan_is_known_by_what_it_includes_too(tmp_path):
    plan, walls, shelf = (tmp_path / f"{name}.xml" for name in ("plan", "walls", "shelf"))
    plan.write_text('<mujoco><include file="walls.xml"/></mujoco>')
    walls.write_text('<mujoco><include file="shelf.xml"/></mujoco>')
    shelf.write_text("<mujoco/>")
    before = content_hash(plan)
    shelf.write_text("<mujoco><worldbody/></mujoco>")
    after = content_hash(plan)
    walls.write_text("<mujoco/>")
    assert len({before, after, content_hash(plan)}) == 3
    walls.write_text("<mujoco>")
    assert content_hash(plan) == str(plan)


def test_the_code_version_follows_what_a_run_imports_and_nothing_else(tmp_path, monkeypatch):
    used = sources("experiments.sweeping.jobs")
    assert {"occmap.explorer", "occmap.goals_kernels", "sim.generators.hall", "experiments.scoring"} <= set(
        used
    )
    assert set(used).isdisjoint({"experiments.report", "experiments.compare", "experiments.explore"})
    (tmp_path / "occmap").mkdir()
    package, module = tmp_path / "occmap" / "__init__.py", tmp_path / "occmap" / "explorer.py"
    package.write_text("from occmap import explorer\n")
    module.write_text("import numpy\n")
    monkeypatch.setattr(code_version, "ROOT", tmp_path)
    assert sources("occmap") == {"occmap": package, "occmap.explorer": module}
