"""Reads Nav2 maps (YAML + image): which cells of a plan are free.

A small reader of its own, because the world knows nothing of the mind's `occmap.map_server`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2

Mode = Literal["trinary", "scale", "raw"]
UNKNOWN_PIXEL = 205
"""What map_saver writes for unknown: no threshold makes a trinary map's unknown free."""


@dataclass(frozen=True)
class MapMeta:
    """What a Nav2 map's YAML says of its image (nav2_map_server)."""

    resolution_m: float
    world_from_image: Pose2 = field(default_factory=Pose2.identity)
    """The pose of the image's lower-left corner."""
    mode: Mode = "trinary"
    negate: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise ValueError(f"a plan's resolution must be positive, got {self.resolution_m}")
        if self.mode not in get_args(Mode):
            raise ValueError(f"unknown map mode {self.mode!r}: choose from {', '.join(get_args(Mode))}")
        if not 0.0 <= self.free_thresh <= self.occupied_thresh <= 1.0:
            thresholds = f"{self.free_thresh} and {self.occupied_thresh}"
            raise ValueError(f"need 0 <= free_thresh <= occupied_thresh <= 1, got {thresholds}")


def free_cells(shade: NDArray[np.float64], meta: MapMeta) -> NDArray[np.bool_]:
    """(ny, nx) which cells are free, row 0 at the lowest y; what is unknown or in doubt is not.

    shade: (ny, nx) pixels from 0 black to 255 white, row 0 at the top, nan where transparent.
    """
    if meta.mode == "raw":
        free = shade <= 100.0 * meta.free_thresh
    else:
        occupied = shade / 255.0 if meta.negate else 1.0 - shade / 255.0
        free = occupied < meta.free_thresh
    if meta.mode == "trinary":
        free &= np.round(shade) != (255 - UNKNOWN_PIXEL if meta.negate else UNKNOWN_PIXEL)
    return np.flipud(free)


def read_image(path: Path) -> NDArray[np.float64]:
    """(ny, nx) grey from 0 to 255, row 0 at the top; nan where the image is transparent."""
    import imageio.v3 as iio

    try:
        is_printed = iio.immeta(path, plugin="pillow").get("mode") == "CMYK"  # whose white is 0
        pixels = np.asarray(iio.imread(path, plugin="pillow", mode="RGB" if is_printed else None))
    except Exception as error:  # each decoder has its own kinds of errors
        raise ValueError(f"{path} is not an image that can be read: {error}") from error
    white = {"b": 1.0, "u": float(np.iinfo(pixels.dtype).max) if pixels.dtype.kind == "u" else 1.0}
    shade = pixels.astype(np.float64) * (255.0 / white.get(pixels.dtype.kind, 65535.0))
    if shade.ndim == 2:
        return shade
    if shade.ndim != 3 or shade.shape[2] not in (1, 2, 3, 4):
        raise ValueError(f"{path} is not a flat image: its pixels have shape {shade.shape}")
    channels = 1 if shade.shape[2] <= 2 else 3
    grey = shade[:, :, :channels].mean(axis=2)
    if shade.shape[2] in (2, 4):
        grey[shade[:, :, -1] < 128.0] = np.nan
    return grey


def read_map_yaml(path: Path) -> tuple[Path, MapMeta]:
    """The image that a Nav2 map's YAML names, and what it says about it."""
    import yaml

    try:
        said: Any = yaml.safe_load(path.read_text())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not a map: {error}") from error
    missing = {"image", "resolution", "origin"} - set(said if isinstance(said, dict) else ())
    if missing:
        raise ValueError(f"{path} is not a Nav2 map: it does not say {', '.join(sorted(missing))}")
    try:
        origin = [float(v) for v in said["origin"]]
        meta = MapMeta(
            resolution_m=float(said["resolution"]),
            world_from_image=Pose2(origin[0], origin[1], origin[2] if len(origin) > 2 else 0.0),
            mode=said.get("mode", "trinary"),
            negate=bool(int(said.get("negate", 0))),
            occupied_thresh=float(said.get("occupied_thresh", MapMeta.occupied_thresh)),
            free_thresh=float(said.get("free_thresh", MapMeta.free_thresh)),
        )
    except (TypeError, ValueError, IndexError, OverflowError) as error:
        raise ValueError(f"{path} is not a Nav2 map: {error}") from error
    return find_image(path, str(said["image"])), meta


def find_image(yaml_path: Path, image: str) -> Path:
    """Where the YAML says, relative to itself or absolute; else a file of that name beside the YAML."""
    named = yaml_path.parent / image
    beside = yaml_path.parent / PureWindowsPath(image).name  # knows both kinds of slashes
    for candidate in (named, beside):
        if candidate.is_file():
            return candidate
    raise ValueError(f"{yaml_path} names the image {image!r}, but there is no {named} and no {beside}")
