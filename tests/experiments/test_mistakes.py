"""What a user may get wrong: a clear error before anything is simulated, and never a traceback."""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from experiments.explore import main
from tests.experiments.commands import mistake

MISTAKES = {
    "unknown option": (["--buidling.kind", "maze"], "buidling"),
    "unknown kind": (["--building.kind", "castle"], "castle"),
    "no number": (["--seed", "many"], "many"),
    "negative seed": (["--seed", "-3"], "-3"),
    "negative resolution": (["--map.resolution-m", "-0.05"], "-0.05"),
    "resolution nan": (["--map.resolution-m", "nan"], "nan"),
    "zero beams": (["--lidar.beams", "0"], "beam"),
    "too many beams": (["--lidar.beams", "100000"], "at most 65534 beams, got 100000"),
    "a range in millimetres": (["--lidar.max-range-m", "12000"], "reaches 12000 m"),
    "obstacles thicker than any": (["--sensor-model.obstacle-thickness-m", "1e12"], "reaches 1e+12 m"),
    "negative lambda": (["--lambda", "-1"], "lambda"),
    "negative noise": (["--noise-scale", "-1"], "noise_scale"),
    "drift beyond all wheels": (["--drift-scale", "300"], "drift_scale 300.0 is too much"),
    "speed beyond the motors": (["--robot.max-linear-mps", "3"], "max_linear_mps 3.0"),
    "thresholds crossed": (["--map.free-below", "0.8"], "free_below"),
    "negative braking": (["--follower.braking-mps2", "-1"], "braking_mps2"),
    "clearance beyond a byte": (["--map.resolution-m", "0.003"], "truncate_m of 1.0 is more than 254 cells"),
    "a margin beyond a byte": (["--planner.roomy-margin-m", "20"], "truncate_m of 20.17"),
    "a margin nan": (["--planner.wall-blur-m", "nan"], "wall_blur_m"),
    "no time": (["--time-limit-s", "0"], "time_limit_s"),
    "a building too small": (["--building.size-m", "1", "1"], "at least"),
    "start outside": (["--start", "-50", "0", "0"], "outside"),
    "start in a wall": (["--building.kind", "maze", "--start", "0.05", "0.05", "0"], "inside a wall"),
    "start not a number": (["--start", "nan", "0", "0"], "start"),
    "plan missing": (["--plan", "nowhere.yaml"], "nowhere.yaml"),
    "a resolution without a plan": (["--plan-resolution-m", "0.05"], "--plan"),
    "doors that are not there": (["--building.kind", "maze", "--faults.close-doors-at-s", "5"], "no doors"),
    "doors that never close": (["--faults.close-doors", "0"], "close_doors_at_s"),
    "a lift that never begins": (["--faults.lift-for-s", "5"], "lift_at_s"),
    "blindness that never begins": (["--faults.blind-for-s", "5"], "blind_at_s"),
    "config missing": (["--config", "nowhere.json"], "nowhere.json"),
}


PLANS = {
    "an image that is not there": (
        "image: nowhere.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n",
        "nowhere.pgm",
    ),
    "no map": ("colour: red\n", "plan.yaml"),
    "no YAML": ("{", "plan.yaml"),
    "all solid": ("image: solid.png\nresolution: 0.05\norigin: [0, 0, 0]\n", "solid"),
    "no resolution": ("image: solid.png\norigin: [0, 0, 0]\n", "resolution"),
    "a negative resolution": ("image: solid.png\nresolution: -1\norigin: [0, 0, 0]\n", "resolution"),
}


@pytest.mark.parametrize(("text", "complaint"), PLANS.values(), ids=PLANS.keys())
def test_a_plan_that_is_none_is_named(text, complaint, tmp_path, capsys):
    (tmp_path / "plan.yaml").write_text(text)
    imageio.imwrite(tmp_path / "solid.png", np.zeros((20, 20), np.uint8))
    expect_mistake(["--plan", str(tmp_path / "plan.yaml")], complaint, tmp_path / "run", capsys)


@pytest.mark.parametrize(("arguments", "complaint"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_named_before_anything_is_simulated(arguments, complaint, tmp_path, capsys):
    expect_mistake(arguments, complaint, tmp_path / "run", capsys)


def expect_mistake(
    arguments: list[str], complaint: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert complaint in mistake(main, ["--no-record", "--no-video", "--out", str(out), *arguments], capsys)
    assert not out.exists()


def test_an_unknown_key_in_a_config_file_is_named_with_the_valid_ones(tmp_path, capsys):
    file = tmp_path / "config.json"
    file.write_text('{"lidar": {"beems": 3}}')
    assert main(["--config", str(file), "--out", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err
    assert "beems" in said
    assert "max_range_m" in said


def test_an_output_folder_that_cannot_be_is_a_mistake(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["--no-record", "--no-video", "--out", str(tmp_path / "file" / "run")]) == 2
    assert "cannot write to --out" in capsys.readouterr().err
