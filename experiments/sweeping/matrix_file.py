"""A sweep's matrix from a TOML or YAML file.

seeds = [0, 100]                        # FIRST up to but without LAST
kinds = ["office", "hall"]
strategies = ["nearest", "utility"]

[experiment]                            # the same in every run, nested as in a config.json
pose = "slam"
lidar.max_range_m = 20

[vary]                                  # any other option, crossed with all the rest
"lidar.beams" = [180, 360]
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments import config_file
from experiments.sweeping.matrix import Matrix, text_of


def read_matrix(file: Path) -> Matrix:
    """The matrix that a file describes. What it leaves out keeps its default; paths are relative to it."""
    data = _data(file)
    if not isinstance(data, dict):
        raise ValueError(f"{file}: expected the axes of a sweep, got {data!r}")
    vary = data.pop("vary", {})
    if not isinstance(vary, dict) or not all(isinstance(values, list) and values for values in vary.values()):
        raise ValueError(f"{file}: vary must name options with a list of values each, got {vary!r}")
    data["vary"] = [text_of(option, values) for option, values in vary.items()]
    if isinstance(data.get("plans"), list):
        data["plans"] = [str(file.parent / str(plan)) for plan in data["plans"]]
    return config_file.from_plain(Matrix, data, where=str(file))


def _data(file: Path) -> Any:
    """The plain contents."""
    try:
        text = file.read_text()
    except OSError as error:
        raise ValueError(f"cannot read the matrix {file}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{file} is not a text file: {error}") from error
    if file.suffix == ".toml":
        import tomllib

        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"{file} is not a TOML file: {error}") from error
    if file.suffix in (".yaml", ".yml"):
        import yaml

        try:
            return yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ValueError(f"{file} is not a YAML file: {error}") from error
    raise ValueError(f"a matrix is a .toml or a .yaml file, got {file}")
