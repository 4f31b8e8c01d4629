"""Laws of a long look: the mean of many scans has less noise, and what happens once does not count."""

from __future__ import annotations

import math

import numpy as np

from occmap.geometry import Pose2
from occmap.localization.long_look import LongLook
from occmap.scan import Scan

BEAMS, SIGMA_M, LOOKS = 360, 0.02, 25
BEARINGS = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
TRUE_M = 3.0 + np.cos(3.0 * BEARINGS)


def scan_of(ranges) -> Scan:
    return Scan(BEARINGS, ranges, 12.0, 0.05)


def looked(spoil=lambda ranges, rng: ranges) -> Scan:
    rng = np.random.default_rng(2)
    scans = [scan_of(spoil(TRUE_M + SIGMA_M * rng.standard_normal(BEAMS), rng)) for _ in range(LOOKS)]
    look = LongLook(scans[0], Pose2.identity())
    assert all(look.add(scan) for scan in scans[1:])
    assert len(look) == LOOKS
    return look.mean()


def test_noise_falls_with_the_root_of_the_looks():
    error = looked().ranges_m - TRUE_M
    assert 0.8 < np.std(error) / (SIGMA_M / math.sqrt(LOOKS)) < 1.2


def test_what_comes_between_now_and_then_does_not_count():
    def spoil(ranges, rng):
        chance = rng.random(BEAMS)
        return np.where(
            chance < 0.05, 1.0, np.where(chance < 0.1, np.nan, np.where(chance < 0.15, np.inf, ranges))
        )

    error = looked(spoil).ranges_m - TRUE_M
    assert np.abs(error).max() < 6.0 * SIGMA_M / math.sqrt(LOOKS)


def test_a_beam_that_hardly_ever_met_anything_says_nothing():
    mean = looked(lambda ranges, rng: np.where((BEARINGS > 0.0) & (rng.random() < 0.9), np.inf, ranges))
    assert np.isnan(mean.ranges_m[BEARINGS > 0.0]).all()
    assert np.isfinite(mean.ranges_m[BEARINGS <= 0.0]).all()


def test_scans_of_other_beams_are_not_mixed_in():
    look = LongLook(scan_of(TRUE_M), Pose2.identity())
    assert not look.add(Scan(BEARINGS[:-1], TRUE_M[:-1], 12.0, 0.05))
    assert len(look) == 1
