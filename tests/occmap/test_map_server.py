"""Nav2 maps: what is written is read back, and what others write is understood."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from occmap.geometry import Pose2
from occmap.grid import Belief
from occmap.map_server import load_map, save_map
from occmap.pgm import read_pgm
from tests.ascii_maps import ascii_state

PLAN = ascii_state("""####
                      #..?
                      ####""")
ORIGIN = Pose2(-1.0 / 3.0, math.pi, -2.0 / 7.0)


def write(folder: Path, pixels: list[list[int]], **fields: object) -> Path:
    """A map as somebody else may have written it: P2 with comments, fields as given."""
    ny, nx = len(pixels), len(pixels[0])
    rows = "\n".join(" ".join(map(str, row)) for row in pixels)
    (folder / "plan.pgm").write_text(f"P2 # by hand\n# a comment\n{nx} {ny}\n255\n{rows}\n")
    usual = {"image": "plan.pgm", "resolution": 0.1, "origin": [0.0, 0.0, 0.0], "negate": 0}
    path = folder / "plan.yaml"
    path.write_text(yaml.safe_dump(usual | {"occupied_thresh": 0.65, "free_thresh": 0.25} | fields))
    return path


def test_a_saved_map_reads_back_the_same_to_the_last_digit(tmp_path: Path):
    loaded = load_map(save_map(tmp_path / "a.b", PLAN, 0.05, ORIGIN))
    np.testing.assert_array_equal(loaded.state, PLAN)
    assert loaded.origin == ORIGIN
    assert loaded.resolution_m == 0.05


def test_the_file_is_what_nav2_expects(tmp_path: Path):
    path = save_map(tmp_path / "map", PLAN, 0.05, ORIGIN)
    fields = yaml.safe_load(path.read_text())
    assert fields["image"] == "map.pgm"
    assert (fields["mode"], fields["negate"], fields["free_thresh"]) == ("trinary", 0, 0.196)
    data = (tmp_path / "map.pgm").read_bytes()
    assert data == b"P5\n4 3\n255\n" + bytes([0, 0, 0, 0, 0, 254, 254, 205, 0, 0, 0, 0])


def test_image_row_0_is_the_highest_y(tmp_path: Path):
    state = ascii_state("""#.
                           ..""")
    save_map(tmp_path / "map", state, 0.05, Pose2.identity())
    assert read_pgm(tmp_path / "map.pgm")[0, 0] == 0.0


def test_205_is_unknown_in_a_trinary_map_whatever_free_thresh_says(tmp_path: Path):
    path = write(tmp_path, [[254, 205, 0]], free_thresh=0.25)
    assert load_map(path).state.tolist() == [[Belief.FREE, Belief.UNKNOWN, Belief.OCCUPIED]]


@pytest.mark.parametrize("negate", [1, True])
def test_negate_swaps_black_and_white(tmp_path: Path, negate: object):
    path = write(tmp_path, [[0, 50, 255]], negate=negate)
    assert load_map(path).state.tolist() == [[Belief.FREE, Belief.UNKNOWN, Belief.OCCUPIED]]


def test_scale_takes_205_for_a_likely_free_cell_and_the_middle_for_unknown(tmp_path: Path):
    path = write(tmp_path, [[254, 205, 128, 0]], mode="scale")
    assert load_map(path).state.tolist() == [[Belief.FREE, Belief.FREE, Belief.UNKNOWN, Belief.OCCUPIED]]


def test_raw_pixels_are_percentages(tmp_path: Path):
    path = write(tmp_path, [[0, 50, 100, 255]], mode="raw")
    assert load_map(path).state.tolist() == [[Belief.FREE, Belief.UNKNOWN, Belief.OCCUPIED, Belief.UNKNOWN]]


def test_sixteen_bit_images_are_read(tmp_path: Path):
    path = write(tmp_path, [[0]])
    (tmp_path / "plan.pgm").write_bytes(b"P5\n2 1\n65535\n" + np.array([0, 65535], ">u2").tobytes())
    assert load_map(path).state.tolist() == [[Belief.OCCUPIED, Belief.FREE]]


def test_an_image_that_moved_is_found_beside_the_yaml(tmp_path: Path):
    for image in ("/nowhere/else/plan.pgm", "../gone/plan.pgm", str(tmp_path / "plan.pgm")):
        assert load_map(write(tmp_path, [[254]], image=image)).state.tolist() == [[Belief.FREE]]


def test_another_reader_may_read_other_images(tmp_path: Path):
    path = write(tmp_path, [[254]])
    loaded = load_map(path, read_image=lambda image: np.zeros((1, 2)))
    assert loaded.state.tolist() == [[Belief.OCCUPIED, Belief.OCCUPIED]]


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"mode": "shiny"}, "trinary, scale or raw"),
        ({"resolution": -0.05}, "resolution must be positive"),
        ({"resolution": float("nan")}, "resolution must be a number"),
        ({"origin": [1.0]}, "origin must be"),
        ({"origin": "here"}, "origin must be"),
        ({"free_thresh": "low"}, "free_thresh must be a number"),
        ({"negate": "no"}, "negate must be a number"),
    ],
)
def test_nonsense_is_refused_with_its_value(tmp_path: Path, fields: dict[str, object], complaint: str):
    with pytest.raises(ValueError, match=complaint):
        load_map(write(tmp_path, [[254]], **fields))


def test_a_missing_image_names_all_places_that_were_tried(tmp_path: Path):
    with pytest.raises(FileNotFoundError, match=r"names the image maps/lost\.pgm"):
        load_map(write(tmp_path, [[254]], image="maps/lost.pgm"))


@pytest.mark.parametrize("text", ["just words", "[1, 2]", "resolution: 0.05", "a: [", ""])
def test_a_file_that_is_no_map_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"plan\.yaml"):
        load_map(path)


@pytest.mark.parametrize(
    "image", [b"", b"\x89PNG\r\n", b"P5\n4 4\n255\n\x00", b"P5\n0 4\n255\n", b"P2\n2 2\n255\n1 2 3"]
)
def test_a_broken_image_is_refused_by_name(tmp_path: Path, image: bytes):
    path = write(tmp_path, [[254]])
    (tmp_path / "plan.pgm").write_bytes(image)
    with pytest.raises(ValueError, match=r"plan\.pgm"):
        load_map(path)
