"""Nav2 maps and images -> Building: the raster comes back, and mistakes are named."""

from __future__ import annotations

import math
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

from occmap.geometry import Pose2
from sim.building import Building
from sim.nav2_map import MapMeta, find_image, free_cells, read_image
from sim.plan_images import MARGIN_M, load_plan
from sim.starts import BODY_RADIUS_M
from sim.truth import explorable, truth_grid

FREE, OCCUPIED, UNKNOWN = 254, 0, 205


def ragged_image(seed: int = 0) -> np.ndarray:
    """(50, 70) pixels, row 0 at the top: two rooms, noisy walls, unknown all around, free at one edge."""
    rng = np.random.default_rng(seed)
    image = np.full((50, 70), UNKNOWN, np.uint8)
    image[5:45, 5:70] = FREE
    image[5:45, 30:33] = OCCUPIED
    image[20:32, 30:33] = FREE
    image[rng.random(image.shape) < 0.03] = OCCUPIED
    image[15:35, 10:28] = FREE
    return image


def write_map(folder: Path, image: np.ndarray, yaml: str = "", name: str = "map.pgm") -> Path:
    iio.imwrite(folder / name, image)
    path = folder / "map.yaml"
    path.write_text(yaml or f"image: {name}\nresolution: 0.05\norigin: [-1.5, 2.25, 0.0]\n")
    return path


def load(path: Path, **options) -> Building:
    return load_plan(path, np.random.default_rng(0), **options)


def raster_of(building: Building, resolution_m: float, shape: tuple[int, int]) -> np.ndarray:
    """The truth grid inside the plan's bounds."""
    truth = truth_grid(building, resolution_m)
    ix, iy = truth.cell_from_world(np.array([building.low_m]) + 0.5 * resolution_m)[0]
    return truth.wall[iy : iy + shape[0], ix : ix + shape[1]]


@pytest.mark.parametrize("name", ["map.pgm", "map.png"])
def test_the_rebuilt_raster_equals_the_source(tmp_path: Path, name: str):
    image = ragged_image()
    building = load(write_map(tmp_path, image, name=name))
    assert building.low_m == pytest.approx((-1.5, 2.25))
    assert building.high_m == pytest.approx((-1.5 + 3.5, 2.25 + 2.5))
    np.testing.assert_array_equal(raster_of(building, 0.05, image.shape), np.flipud(image != FREE))


def test_off_the_image_everything_is_solid(tmp_path: Path):
    building = load(write_map(tmp_path, ragged_image()))
    truth = truth_grid(building, 0.05)
    seen = explorable(truth, building.start, BODY_RADIUS_M, 12.0)
    assert seen.any()
    assert not seen[:, truth.cell_from_world(np.array([building.high_m]))[0, 0] :].any()


def test_a_wide_margin_of_the_unknown_is_cut_down(tmp_path: Path):
    """Mappers save canvases of 200 m, and every cell of them would cost memory and time."""
    image = ragged_image()  # is free from column 5 to its right edge, and from row 5 to 44
    canvas = np.pad(image, ((200, 100), (150, 250)), constant_values=UNKNOWN)
    building = load(write_map(tmp_path, canvas))
    margin = round(MARGIN_M / 0.05)
    left, below, right, above = 155 - margin, 105 - margin, 220 + margin, 145 + margin
    assert building.low_m == pytest.approx((-1.5 + left * 0.05, 2.25 + below * 0.05))
    assert building.high_m == pytest.approx((-1.5 + right * 0.05, 2.25 + above * 0.05))
    expected = np.flipud(canvas != FREE)[below:above, left:right]
    np.testing.assert_array_equal(raster_of(building, 0.05, expected.shape), expected)


def test_an_image_alone_needs_its_resolution_and_lies_at_the_origin(tmp_path: Path):
    iio.imwrite(tmp_path / "plan.png", ragged_image())
    building = load(tmp_path / "plan.png", resolution_m=0.1)
    assert building.low_m == (0.0, 0.0)
    assert building.high_m == pytest.approx((7.0, 5.0))
    with pytest.raises(ValueError, match="how many metres a pixel is wide"):
        load(tmp_path / "plan.png")


def test_the_same_rng_gives_the_same_start_and_it_lies_in_the_largest_room(tmp_path: Path):
    image = np.full((60, 80), OCCUPIED, np.uint8)
    image[2:58, 2:20] = FREE
    image[2:58, 25:78] = FREE
    path = write_map(tmp_path, image)
    assert load(path).start == load(path).start
    for seed in range(5):
        assert load_plan(path, np.random.default_rng(seed)).start.x_m > -1.5 + 25 * 0.05


def test_a_plan_of_few_large_pixels_has_its_start_inside(tmp_path: Path):
    image = np.pad(np.full((6, 6), FREE, np.uint8), 1, constant_values=OCCUPIED)
    iio.imwrite(tmp_path / "plan.png", image)
    for seed in range(20):
        start = load_plan(tmp_path / "plan.png", np.random.default_rng(seed), resolution_m=1.0).start
        assert all(1.0 < at < 7.0 for at in start.position)


def test_a_plan_that_says_its_size_is_not_told_another(tmp_path: Path):
    (tmp_path / "plan.xml").write_text("<mujoco/>")
    for path in (write_map(tmp_path, ragged_image()), tmp_path / "plan.xml"):
        with pytest.raises(ValueError, match=r"says itself how large it is: leave .* 0\.1 m out"):
            load(path, resolution_m=0.1)


def test_a_given_start_is_in_the_plans_own_frame(tmp_path: Path):
    start = Pose2(-0.5, 3.5, 1.0)  # column 20, row 25 of the image
    assert load(write_map(tmp_path, ragged_image()), start=start).start == start
    with pytest.raises(ValueError, match="outside of the building"):
        load(tmp_path / "map.yaml", start=Pose2(20.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="inside a wall"):
        load(tmp_path / "map.yaml", start=Pose2(-1.45, 2.3, 0.0))


@pytest.mark.parametrize("free_thresh", [0.1, 0.196, 0.25, 0.6])
def test_205_is_unknown_in_trinary_maps_whatever_the_threshold(free_thresh: float):
    shade = np.array([[205.0, 254.0, 0.0]])
    meta = MapMeta(0.05, free_thresh=free_thresh)
    assert free_cells(shade, meta).tolist() == [[False, True, False]]


def test_negate_exchanges_black_and_white():
    meta = MapMeta(0.05, negate=True, free_thresh=0.25)
    assert free_cells(np.array([[0.0, 255.0, 50.0, 205.0]]), meta).tolist() == [[True, False, False, False]]


def test_scale_and_raw_maps():
    assert free_cells(np.array([[205.0, 100.0]]), MapMeta(0.05, mode="scale", free_thresh=0.25)).tolist() == [
        [True, False]
    ]
    assert free_cells(np.array([[0.0, 100.0, 255.0]]), MapMeta(0.05, mode="raw")).tolist() == [
        [True, False, False]
    ]


def test_colour_sixteen_bits_and_transparency(tmp_path: Path):
    image = ragged_image()
    clear = np.where(image == FREE, 255, 0).astype(np.uint8)
    expected = np.flipud(image != FREE)
    variants = {
        "rgb": np.repeat(clear[:, :, None], 3, axis=2),
        "rgba": np.dstack([np.full((*clear.shape, 3), 255, np.uint8), clear]),
        "deep": clear.astype(np.uint16) * 257,
        "bits": clear > 0,
    }
    for name, pixels in variants.items():
        iio.imwrite(tmp_path / f"{name}.png", pixels)
        building = load(tmp_path / f"{name}.png", resolution_m=0.05)
        np.testing.assert_array_equal(raster_of(building, 0.05, image.shape), expected, err_msg=name)


def test_a_printers_colours_are_read_as_what_they_show(tmp_path: Path):
    grey = Image.fromarray(np.repeat(np.repeat(np.array([[0, 255], [255, 255]], np.uint8), 40, 0), 40, 1))
    grey.convert("CMYK").save(tmp_path / "printed.jpg", quality=100, subsampling=0)
    shade = read_image(tmp_path / "printed.jpg")
    assert shade.shape == (80, 80)
    assert shade[20, 20] < 10.0
    assert shade[20, 60] > 245.0


def test_an_origin_with_yaw_turns_the_plan(tmp_path: Path):
    path = write_map(
        tmp_path, ragged_image(), "image: map.pgm\nresolution: 0.05\norigin: [1.0, 2.0, 1.5707963267948966]\n"
    )
    building = load(path)
    assert building.low_m == pytest.approx((1.0 - 2.5, 2.0))
    assert building.high_m == pytest.approx((1.0, 2.0 + 3.5))


@pytest.mark.parametrize("yaw_rad", [0.3, 0.25 * math.pi, 2.0, -2.8])
@pytest.mark.parametrize("unknown", [0, 100])
def test_around_a_turned_image_all_is_solid(tmp_path: Path, yaw_rad: float, unknown: int):
    """The robot is put down in the plan, not in the corners that it leaves of the building."""
    image = np.full((40, 160), FREE, np.uint8)  # long: its corners are larger than it is wide
    image = np.pad(image, unknown, constant_values=UNKNOWN)
    yaml = f"image: map.pgm\nresolution: 0.05\norigin: [1, 2, {yaw_rad}]\n"
    building = load(write_map(tmp_path, image, yaml))
    truth = truth_grid(building, 0.05)
    iy, ix = np.nonzero(~truth.wall)
    image_from_world = Pose2(1.0, 2.0, yaw_rad).inverse()
    floor = image_from_world.apply(truth.world_from_cell(np.column_stack((ix, iy))))
    assert (np.abs(floor - unknown * 0.05 - (4.0, 1.0)) < (4.0, 1.0)).all()
    assert len(floor) * 0.05**2 == pytest.approx(8.0 * 2.0, rel=0.06)
    assert not truth.wall[truth.cell_of(building.start)[::-1]]


def test_the_image_is_found_relative_absolute_or_beside(tmp_path: Path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    for folder in ("a", "b"):
        (tmp_path / folder / "map.pgm").touch()
    yaml = tmp_path / "a" / "map.yaml"
    assert find_image(yaml, "map.pgm") == tmp_path / "a" / "map.pgm"
    assert find_image(yaml, "../b/map.pgm").samefile(tmp_path / "b" / "map.pgm")
    assert find_image(yaml, str(tmp_path / "b" / "map.pgm")) == tmp_path / "b" / "map.pgm"
    assert find_image(yaml, "/home/somebody/maps/map.pgm") == tmp_path / "a" / "map.pgm"
    assert find_image(yaml, r"C:\maps\map.pgm") == tmp_path / "a" / "map.pgm"
    with pytest.raises(ValueError, match=r"names the image 'office\.pgm'"):
        find_image(yaml, "office.pgm")


@pytest.mark.parametrize(
    ("yaml", "message"),
    [
        ("resolution: 0.05\norigin: [0, 0, 0]\n", "does not say image"),
        ("- a\n- list\n", "does not say image, origin, resolution"),
        ("image: [\n", "is not a map"),
        ("image: map.pgm\nresolution: -0.05\norigin: [0, 0, 0]\n", "must be positive, got -0.05"),
        ("image: map.pgm\nresolution: .nan\norigin: [0, 0, 0]\n", "must be positive, got nan"),
        ("image: map.pgm\nresolution: 0.05\norigin: [0]\n", "is not a Nav2 map"),
        ("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: .inf\n", "is not a Nav2 map"),
        (f"image: map.pgm\nresolution: 1{'0' * 400}\norigin: [0, 0, 0]\n", "is not a Nav2 map"),
        ("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nmode: colour\n", "unknown map mode 'colour'"),
        ("image: map.pgm\nresolution: 0.05\norigin: [0, 5.2e6, 0]\n", "move its origin nearer"),
        ("image: nowhere.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n", "names the image 'nowhere.pgm'"),
    ],
)
def test_mistakes_in_the_yaml_are_named(tmp_path: Path, yaml: str, message: str):
    with pytest.raises(ValueError, match=message):
        load(write_map(tmp_path, ragged_image(), yaml))


def test_plans_without_space_are_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="all solid"):
        load(write_map(tmp_path, np.full((20, 20), UNKNOWN, np.uint8)))
    slit = np.full((20, 20), OCCUPIED, np.uint8)
    slit[10] = FREE
    with pytest.raises(ValueError, match="no place for a robot"):
        load(write_map(tmp_path, slit))


def test_files_that_are_no_plans_are_refused(tmp_path: Path):
    (tmp_path / "plan.png").write_text("not an image")
    (tmp_path / "plan.txt").write_text("not a plan")
    for name, message in (
        ("plan.png", "not an image"),
        ("plan.txt", "not a plan"),
        ("none.png", "no plan file"),
    ):
        with pytest.raises(ValueError, match=message):
            load(tmp_path / name, resolution_m=0.05)
    iio.imwrite(tmp_path / "good.png", ragged_image())
    with pytest.raises(ValueError, match="resolution must be positive"):
        load(tmp_path / "good.png", resolution_m=-1.0)
