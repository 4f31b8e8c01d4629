"""Poses and grid change together, whether or not the run was cut in two meanwhile."""

from itertools import groupby
from operator import itemgetter

import numpy as np
import pytest

from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.state_file import load, save
from occmap.localization.told_map import ToldMapConfig
from tests.occmap.localization.drives import RING, RING_LAP, drive, observe

CUTS = ("before a correction", "as it begins", "while it is built", "in the next one", "after that")
EVERY = 12
"""Of the scans before which the state is saved, one in so many."""
SLOWLY = ToldMapConfig(
    moved_m=0.005, seam_m=1e-9, scans_per_turn=10, surveyed_per_turn=40, scans_on_average=40
)


@pytest.fixture(scope="module")
def ring():
    return observe(RING, drive([*RING_LAP, *RING_LAP, RING_LAP[0]]), np.random.default_rng(0))


@pytest.fixture(scope="module")
def told(ring, tmp_path_factory: pytest.TempPathFactory):
    """What one run told of every scan, and some states saved on the way: (scan, path) by CUTS."""
    slam, estimates, saved = SlamLocalizer(SlamConfig(told=SLOWLY)), [], []
    folder = tmp_path_factory.mktemp("states")
    for k, seen in enumerate(ring):
        if k % EVERY == 0:
            save(folder / str(k), slam)
            saved.append((k, slam.told.is_rebuilding))
        estimates.append(slam.update(seen))
    phases = [[k for k, _ in phase] for _, phase in groupby(saved, key=itemgetter(1))]
    assert len(phases) >= 5, "two corrections, each told after a while"
    before, first, _, second, after = phases[:5]
    scans = (before[-1], first[0], first[-1], second[0], after[0])
    return estimates, {cut: (scan, folder / str(scan)) for cut, scan in zip(CUTS, scans, strict=True)}


@pytest.mark.parametrize("cut", CUTS)
def test_corrections_take_effect_at_the_same_scan_wherever_the_run_is_cut(ring, told, cut: str):
    estimates, states = told
    first, path = states[cut]
    slam = load(path)
    for k in range(first, len(ring)):
        estimate = slam.update(ring[k])
        assert estimate.map_from_robot == estimates[k].map_from_robot
        assert estimate.insert == estimates[k].insert
        assert (estimate.grid is None) == (estimates[k].grid is None and k > first)
