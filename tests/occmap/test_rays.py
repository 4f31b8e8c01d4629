"""Rays: the lesson's line, cell for cell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from occmap.rays import ray_cells
from occmap.vote_kernels import count_ray

CELL = st.integers(-60, 60)


def lesson_bresenham(x0: int, y0: int, x1: int, y1: int) -> list[tuple[int, int]]:
    """The lesson's own code."""
    cells = []
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x0 < x1 else -1
    sy = 1 if y0 < y1 else -1
    err = dx - dy
    while True:
        cells.append((x0, y0))
        if x0 == x1 and y0 == y1:
            return cells
        e2 = 2 * err
        if e2 > -dy:
            err -= dy
            x0 += sx
        if e2 < dx:
            err += dx
            y0 += sy


def test_lesson_beam_from_0_0_to_4_2():
    assert ray_cells(0, 0, 4, 2).tolist() == [[0, 0], [1, 0], [2, 1], [3, 1], [4, 2]]


@given(CELL, CELL, CELL, CELL)
def test_rays_visit_exactly_the_lessons_cells(x0: int, y0: int, x1: int, y1: int):
    assert [tuple(cell) for cell in ray_cells(x0, y0, x1, y1).tolist()] == lesson_bresenham(x0, y0, x1, y1)


@given(CELL, CELL, CELL, CELL)
def test_rays_contain_both_ends_and_are_connected(x0: int, y0: int, x1: int, y1: int):
    cells = ray_cells(x0, y0, x1, y1)
    assert cells[0].tolist() == [x0, y0]
    assert cells[-1].tolist() == [x1, y1]
    assert (np.abs(np.diff(cells, axis=0)).max(axis=1, initial=0) <= 1).all()
    assert len({tuple(cell) for cell in cells.tolist()}) == len(cells)


def counted(x0: int, y0: int, x1: int, y1: int, size: int) -> list[tuple[int, int]]:
    window = np.zeros(size * size, np.uint16)
    count_ray(window, size, x0, y0, x1, y1)
    iy, ix = np.divmod(np.flatnonzero(window), size)
    assert window.max(initial=0) <= 1
    return sorted(zip(ix.tolist(), iy.tolist(), strict=True))


def test_fixed_point_rays_count_the_lessons_cells_in_all_directions():
    size, middle = 65, 32
    for x in range(size):
        for y in range(size):
            ray = lesson_bresenham(middle, middle, x, y)
            assert counted(middle, middle, x, y, size) == sorted(ray[:-1])


@pytest.mark.parametrize(
    ("dx", "dy"), [(4000, 1999), (4000, 2001), (3999, 2000), (2000, 4000), (3999, 3998), (4001, 1)]
)
def test_fixed_point_rays_stay_exact_over_200_m(dx: int, dy: int):
    size = 4002
    ray = lesson_bresenham(0, 0, dx, dy)
    assert counted(0, 0, dx, dy, size) == sorted(ray[:-1])
