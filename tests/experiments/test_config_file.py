"""A config survives its file; a file that does not fit is refused with the place and the valid names."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest

from experiments import config_file


@dataclass(frozen=True)
class Inner:
    beams: int = 360
    reach_m: float = 12.0
    angles: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        if self.beams <= 0:
            raise ValueError(f"beams must be positive, got {self.beams}")


@dataclass(frozen=True)
class Outer:
    kind: Literal["office", "maze"] = "office"
    plan: Path | None = None
    size_m: tuple[float, float] | None = None
    record: bool = True
    inner: Inner = field(default_factory=Inner)


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "config.json"
    file.write_text(text)
    return file


def test_a_config_survives_its_file(tmp_path):
    config = Outer("maze", Path("a.yaml"), (3.0, 4.0), False, Inner(7, 0.1 + 0.2, (1.0, float("inf"))))
    file = written(tmp_path, json.dumps(config_file.to_plain(config)))
    assert config_file.read(Outer, file) == config


def test_keys_left_out_keep_their_default(tmp_path):
    assert config_file.read(Outer, written(tmp_path, '{"inner": {"reach_m": 3}}')).inner == Inner(reach_m=3.0)


def test_a_whole_number_beyond_all_floats_is_without_end(tmp_path):
    text = f'{{"inner": {{"reach_m": 1{"0" * 400}}}}}'
    assert config_file.read(Outer, written(tmp_path, text)).inner == Inner(reach_m=float("inf"))


@pytest.mark.parametrize(
    ("text", "complaints"),
    [
        ('{"knid": "maze"}', ["knid", "kind"]),
        ('{"inner": {"beam": 3}}', ["inner", "beam", "beams"]),
        ('{"inner": {"beams": 0}}', ["beams must be positive"]),
        ('{"inner": {"beams": 1.5}}', ["beams", "int", "1.5"]),
        ('{"inner": {"beams": true}}', ["beams", "int", "True"]),
        ('{"inner": 3}', ["inner", "3"]),
        ('{"kind": "castle"}', ["castle", "office", "maze"]),
        ('{"size_m": [1]}', ["size_m", "2 values"]),
        ('{"size_m": 1}', ["size_m", "list"]),
        ("[]", ["Outer"]),
        ("{", ["not a JSON file"]),
    ],
)
def test_a_file_that_does_not_fit_is_refused(tmp_path, text, complaints):
    with pytest.raises(ValueError) as refusal:  # noqa: PT011
        config_file.read(Outer, written(tmp_path, text))
    assert all(complaint in str(refusal.value) for complaint in complaints)


def test_keys_that_are_no_names_are_refused_too():
    with pytest.raises(ValueError, match="unknown key 1, 'knid'; valid ones: kind"):
        config_file.from_plain(Outer, {1: 2, "knid": "maze"}, where="file")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match="cannot read"):
        config_file.read(Outer, tmp_path / "nowhere.json")
