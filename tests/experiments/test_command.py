"""The command line, as far as its words go."""

import json
import re
import shlex
from pathlib import Path
from typing import get_args

import pytest

from experiments import config_file
from experiments.command import Command, parse
from experiments.config import ExperimentConfig
from experiments.experiment import boundary_in_map, make_building
from sim.generators import Kind

ROOT = Path(__file__).resolve().parent.parent.parent


def test_no_option_means_every_default():
    assert parse([]) == Command()


def test_the_names_that_people_know():
    arguments = (
        "--building.kind maze --building.seed 3 --building.size-m 8 9 --start 1 -2 -0.5 --pose odometry "
        "--strategy utility --lambda 2 --noise-scale 0 --drift-scale 3 --lidar.beams 90 "
        "--lidar.max-range-m 5 --map.resolution-m 0.1 --map.free-below 0.2 --map.occupied-above 0.8 "
        "--time-limit-s 7 --out x --no-record --no-video --seed 4"
    )
    command = parse(arguments.split())
    config = command.experiment
    assert (command.out, command.record, command.video) == (Path("x"), False, False)
    assert (config.building.kind, config.building.seed, config.building.size_m) == ("maze", 3, (8.0, 9.0))
    assert (config.start, config.pose, config.seed) == ((1.0, -2.0, -0.5), "odometry", 4)
    assert (config.explorer.goals.strategy, config.explorer.goals.lambda_m_per_m2) == ("utility", 2.0)
    assert (config.explorer.grid.resolution_m, config.explorer.grid.free_below) == (0.1, 0.2)
    assert (config.scaled_lidar.noise.range_sigma_m, config.lidar.beams) == (0.0, 90)
    assert config.scaled_odometry.track_error == pytest.approx(3 * config.odometry.track_error)
    assert config.time_limit_s == 7.0


def test_the_buildings_seed_is_a_child_of_the_seed_and_pinned_in_the_file():
    first, second = ExperimentConfig(seed=1), ExperimentConfig(seed=2)
    assert first.building_seed != second.building_seed
    assert first.pinned().building.seed == first.building_seed
    assert first.pinned().pinned() == first.pinned()


@pytest.fixture
def plan_s_config(tmp_path: Path) -> Path:
    """The config.json of a run of a floor plan."""
    file = tmp_path / "config.json"
    config = ExperimentConfig(seed=3, plan=ROOT / "models/plans/flat.xml").pinned()
    file.write_text(json.dumps(config_file.to_plain(config)))
    return file


@pytest.mark.parametrize(
    "option", ["--building.kind office", "--building.kind=hall", "--building.size_m 9 9"]
)
def test_a_generated_building_is_not_asked_for_beside_a_plan(option: str, plan_s_config: Path, capsys):
    """Not even the default kind, if somebody says it; a config.json says it always."""
    name = re.escape(option[:15])
    with pytest.raises(ValueError, match=f"{name}.* does not go with --plan"):
        parse(["--plan", "flat.xml", *option.split()])
    again = ["--config", str(plan_s_config)]
    with pytest.raises(ValueError, match=f"{name}.* does not go with .*config.json"):
        parse([*again, *option.split()])
    assert not capsys.readouterr().err
    assert parse(again).experiment.plan is not None
    assert parse([*again, "--plan", "None", *option.split()]).experiment.plan is None


def test_a_seed_that_does_not_reach_the_building_says_so(plan_s_config: Path, capsys):
    again = ["--config", str(plan_s_config)]
    stays = "building and start stay those of building.seed"
    for options, is_said in ([], False), (["--seed", "4"], True), (["--seed=4", "--building.seed=4"], False):
        parse([*again, *options])
        assert (stays in capsys.readouterr().err) == is_said


def test_the_last_of_two_configs_is_run(tmp_path: Path):
    first, last = tmp_path / "first.json", tmp_path / "last.json"
    first.write_text('{"seed": 11}')
    last.write_text('{"seed": 22}')
    for form in ("--config {} --config {}", "--config={} --config={}"):
        command = parse(form.format(first, last).split())
        assert (command.config, command.experiment.seed) == (last, 22)


def test_a_config_without_a_name_is_refused():
    with pytest.raises(ValueError, match="cannot read the config"):
        parse(["--config", ""])


def commands_shown():
    """What follows `python -m experiments.explore` in README and docs, where it is meant literally."""
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        text = page.read_text().replace("\\\n", " ")
        for command in re.findall(r"^python -m experiments\.explore(.*?)(?: #.*)?$", text, re.MULTILINE):
            if not re.search(r"\b[A-Z]{2,}\b", command):  # KIND, RUN
                yield command.strip()


@pytest.mark.parametrize("command", list(commands_shown()))
def test_the_commands_that_people_are_shown_find_a_building_to_start_in(command, monkeypatch):
    monkeypatch.chdir(ROOT)
    config = parse(shlex.split(command)).experiment
    building = make_building(config)
    if config.boundary:
        boundary_in_map(config, building.start)


def test_help_is_for_newcomers(capsys):
    with pytest.raises(SystemExit) as exit_:
        parse(["--help"])
    said = capsys.readouterr().out
    assert exit_.value.code == 0
    assert "Drop a robot into a building it has never seen" in said
    assert said.index("building options") < said.index("planner options")  # what a first run asks for
    assert ExperimentConfig().pose in said.partition("╭")[0]  # what happens with no options
    assert f"--building.kind {{{','.join(get_args(Kind))}}}" in said
