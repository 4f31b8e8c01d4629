"""Large arrays are moved block by block, and what was never written to stays unwritten."""

import resource

import numpy as np
import pytest

from occmap import lazy_arrays
from occmap.grid import moved
from occmap.lazy_arrays import copy_written, fill_written, filled, lazy_zeros


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(lazy_arrays, "BLOCK", (3, 4))
    monkeypatch.setattr(lazy_arrays, "LARGE_BYTES", 1)


def sparse(shape: tuple[int, int], seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.where(rng.random(shape) < 0.03, rng.normal(size=shape), 0.0).astype(np.float32)


@pytest.mark.parametrize("dtype", [np.float32, np.uint8])
@pytest.mark.parametrize("shape", [(0, 0), (3, 5), (2000, 3000)])
def test_lazy_zeros_are_zeros_as_kernels_want_them(shape, dtype):
    zeros = lazy_zeros(shape, dtype)
    assert zeros.shape == shape
    assert zeros.dtype == dtype
    assert zeros.flags.c_contiguous
    assert zeros.flags.writeable
    assert zeros.flags.aligned
    assert not zeros.any()
    zeros[...] = 7
    assert (zeros == 7).all()


def test_without_huge_pages_they_are_plain_zeros(monkeypatch):
    monkeypatch.setattr(lazy_arrays, "HUGE_PAGES", None)
    assert not lazy_zeros((2000, 3000), np.float32).any()


@pytest.mark.parametrize("shape", [(1, 1), (3, 4), (10, 13), (12, 8)])
def test_what_is_copied_or_filled_by_blocks_is_as_if_done_at_once(small_blocks, shape):
    source, target = sparse(shape, 0), sparse(shape, 1)
    copy_written(source, target)
    np.testing.assert_array_equal(target, source)
    for value in (0, 3):
        filled = sparse(shape, 2)
        fill_written(filled, value)
        assert (filled == value).all()


def test_a_layer_moves_as_a_whole(small_blocks):
    layer = sparse((10, 13), 3)
    out = moved(layer, (2, 3), (-1, 1), (15, 20), np.float32(0.0))
    np.testing.assert_array_equal(out[2:12, 3:16], layer)
    assert np.count_nonzero(out) == np.count_nonzero(layer)


def test_to_move_a_layer_hardly_written_to_takes_hardly_any_memory():
    layer = lazy_zeros((8000, 8000), np.float32)  # 256 MB
    layer[4000:4100, 4000:4100] = 1.0
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    out = moved(layer, (0, 0), (-500, -500), (9000, 9000), np.float32(0.0))
    assert (out[4500:4600, 4500:4600] == 1.0).all()
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb) < 100_000


@pytest.mark.parametrize("value", [0, 0.25, 7])
@pytest.mark.parametrize("shape", [(3, 5), (2000, 3000)])
def test_filled_is_full(shape, value):
    np.testing.assert_array_equal(filled(shape, value, np.float32), np.full(shape, value, np.float32))
