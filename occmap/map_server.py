"""Nav2 maps (YAML + PGM) out and in, as nav2_map_server writes and reads them.

An image's row 0 is the highest y; a map's row 0 is the lowest. The flip happens here and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from occmap.geometry import Pose2
from occmap.grid import Belief
from occmap.pgm import read_pgm, write_pgm

SHADES = np.array([205, 254, 0], np.uint8)
"""The pixel of each Belief in a trinary map."""
OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
"""The usual free_thresh of 0.25 would read our unknown (205, an occupancy of 0.196) back as free."""
WHITE = 255.0
"""The brightest pixel."""
UNKNOWN_OCCUPANCY = 50 / WHITE
"""What 205 stands for; unknown in every trinary map, whatever its free_thresh says."""

ImageReader = Callable[[Path], NDArray[np.float64]]
"""Path -> (ny, nx) brightness from 0 black to 1 white, row 0 the highest y."""


@dataclass(frozen=True)
class NavMap:
    """A map as a file holds it."""

    state: NDArray[np.uint8]  # (ny, nx) of Belief, row 0 at the lowest y
    resolution_m: float
    origin: Pose2  # of the lower-left corner, in the map's frame


def save_map(path_stem: str | Path, state: NDArray[np.uint8], resolution_m: float, origin: Pose2) -> Path:
    """Write `path_stem`.yaml and .pgm, trinary, the origin to the last digit. Returns the YAML's path.

    Of an explorer's grid, or of what SlamLocalizer.map() returns, in the map's own frame:
    `save_map("map", grid.state, grid.frame.resolution_m, Pose2(*grid.frame.origin_m, 0.0))`.
    """
    stem = Path(path_stem)
    image, description = Path(f"{stem}.pgm"), Path(f"{stem}.yaml")
    write_pgm(image, SHADES[state[::-1]])
    fields = {
        "image": image.name,
        "mode": "trinary",
        "resolution": float(resolution_m),
        "origin": [float(origin.x_m), float(origin.y_m), float(origin.yaw_rad)],
        "negate": 0,
        "occupied_thresh": OCCUPIED_THRESHOLD,
        "free_thresh": FREE_THRESHOLD,
    }
    description.write_text(yaml.safe_dump(fields, sort_keys=False, default_flow_style=None))
    return description


def load_map(yaml_path: str | Path, read_image: ImageReader = read_pgm) -> NavMap:
    """Read a Nav2 map in mode trinary, scale or raw; pass a reader for images other than PGM.

    FileNotFoundError if there is no such file, ValueError if it or its image is not what Nav2 would read.
    """
    path = Path(yaml_path)
    fields = _fields(path)
    resolution_m = _number(path, fields, "resolution")
    if resolution_m <= 0.0:
        raise ValueError(f"{path}: resolution must be positive, got {resolution_m}")
    origin = fields.get("origin", [0.0, 0.0, 0.0])
    if not (isinstance(origin, list) and len(origin) in (2, 3) and all(map(_is_number, origin))):
        raise ValueError(f"{path}: origin must be [x, y, yaw], got {origin!r}")
    brightness = read_image(_image_path(path, fields))
    state = states_from_brightness(
        brightness[::-1],
        mode=str(fields.get("mode", "trinary")),
        negate=_is_set(path, fields, "negate"),
        occupied_above=_number(path, fields, "occupied_thresh", OCCUPIED_THRESHOLD),
        free_below=_number(path, fields, "free_thresh", FREE_THRESHOLD),
    )
    return NavMap(state, resolution_m, Pose2(*map(float, [*origin, 0.0][:3])))


def states_from_brightness(
    brightness: NDArray[np.float64], *, mode: str, negate: bool, occupied_above: float, free_below: float
) -> NDArray[np.uint8]:
    """(ny, nx) Belief of pixels (0 black to 1 white), by the rules of nav2_map_server.

    What is undecided is unknown. occupied_above and free_below are occupancies, 0 to 1. ValueError for a mode
    other than trinary, scale and raw.
    """
    occupancy = brightness if negate else 1.0 - brightness
    if mode == "raw":  # the pixel's value is a percentage; above 100 it says nothing
        percent = np.rint(WHITE * brightness)
        undecided, occupancy = percent > 100.0, percent / 100.0
    elif mode == "trinary":
        undecided = np.isclose(occupancy, UNKNOWN_OCCUPANCY, atol=1e-6)
    elif mode == "scale":
        undecided = np.zeros(brightness.shape, np.bool_)
    else:
        raise ValueError(f"a map's mode is trinary, scale or raw, got {mode!r}")
    state = np.full(brightness.shape, Belief.UNKNOWN, np.uint8)
    state[~undecided & (occupancy < free_below)] = Belief.FREE
    state[~undecided & (occupancy > occupied_above)] = Belief.OCCUPIED
    return state


def _fields(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise FileNotFoundError(f"no map description at {path}")
    try:
        fields = yaml.safe_load(path.read_text())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not YAML: {error}") from error
    if not isinstance(fields, dict) or "image" not in fields:
        raise ValueError(f"{path} is not a Nav2 map: it names no image")
    return fields


def _image_path(path: Path, fields: dict[str, Any]) -> Path:
    """The image where the YAML says (relative to itself), or else a file of that name beside the YAML."""
    named = Path(str(fields["image"]))
    candidates = (path.parent / named, path.parent / named.name)
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise FileNotFoundError(
        f"{path} names the image {named}, but there is no {candidates[0]} and no {candidates[1]}"
    )


def _number(path: Path, fields: dict[str, Any], name: str, default: float | None = None) -> float:
    value = fields.get(name, default)
    if not _is_number(value):
        raise ValueError(f"{path}: {name} must be a number, got {value!r}")
    return float(value)


def _is_set(path: Path, fields: dict[str, Any], name: str) -> bool:
    """Whether a flag is set: usually 0 or 1, but Nav2 takes true and false, too."""
    value = fields.get(name, False)
    return value if isinstance(value, bool) else bool(_number(path, fields, name))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
