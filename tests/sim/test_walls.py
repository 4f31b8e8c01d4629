"""Wall cells -> boxes: the boxes rebuild the walls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sim.walls import boxes_of, rectangles_of
from tests.ascii_maps import ascii_map


def rebuilt(rectangles: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    solid = np.zeros(shape, bool)
    for ix0, iy0, ix1, iy1 in rectangles:
        solid[iy0:iy1, ix0:ix1] = True
    return solid


@settings(deadline=None)  # the first call compiles the kernel
@given(arrays(bool, st.tuples(st.integers(1, 20), st.integers(1, 20))))
def test_boxes_rebuild_the_walls(solid: np.ndarray):
    np.testing.assert_array_equal(rebuilt(rectangles_of(solid), solid.shape), solid)


@pytest.mark.parametrize(
    ("picture", "count"),
    [
        ("####\n####", 1),
        ("#...#\n#...#", 2),
        ("#####\n#...#\n#...#\n#####", 4),
        (".#.\n###\n.#.", 2),  # a cross is two boxes that overlap
        ("....\n....", 0),
    ],
)
def test_few_boxes_do(picture: str, count: int):
    assert len(rectangles_of(ascii_map(picture) == "#")) == count


def test_ragged_walls_cost_far_fewer_boxes_than_cells():
    rng = np.random.default_rng(0)
    depth = 10 + rng.integers(0, 3, 200)
    solid = np.arange(40)[:, None] < depth[None, :]
    assert len(rectangles_of(solid)) < 0.5 * 200


def test_boxes_lie_where_their_cells_are():
    (box,) = boxes_of(ascii_map("...\n.##\n...") == "#", 0.5, (-1.0, 2.0))
    assert box.bounds() == (-0.5, 2.5, 0.5, 3.0)
