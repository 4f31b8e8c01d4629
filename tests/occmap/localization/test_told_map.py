"""Poses and grid change together, whether or not the run was cut in two meanwhile."""

import numpy as np
import pytest

from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.state_file import load, save
from occmap.localization.told_map import ToldMapConfig
from tests.occmap.localization.drives import RING, RING_LAP, drive, observe

CUTS = {
    "before the first correction": 400,
    "while the first new grid is surveyed": 423,
    "while it is built": 465,
    "while a part of it is built anew": 600,
    "after that": 715,
}
SLOWLY = ToldMapConfig(
    moved_m=0.005, seam_m=1e-9, scans_per_turn=10, surveyed_per_turn=40, scans_on_average=40
)


@pytest.fixture(scope="module")
def ring():
    return observe(RING, drive([*RING_LAP, *RING_LAP, RING_LAP[0]]), np.random.default_rng(0))


@pytest.fixture(scope="module")
def told(ring, tmp_path_factory: pytest.TempPathFactory):
    """What one run told of every scan, and the folder of the states saved on the way, by their scan."""
    slam, estimates, rebuilding = SlamLocalizer(SlamConfig(told=SLOWLY)), [], {}
    folder = tmp_path_factory.mktemp("states")
    for k, seen in enumerate(ring):
        if k in CUTS.values():
            save(folder / str(k), slam)
            rebuilding[k] = slam.told.is_rebuilding
        estimates.append(slam.update(seen))
    assert list(rebuilding.values()) == [False, True, True, True, False]
    assert sum(estimate.grid is not None for estimate in estimates) == 3
    return estimates, folder


@pytest.mark.parametrize("cut", CUTS.values(), ids=CUTS)
def test_corrections_take_effect_at_the_same_scan_wherever_the_run_is_cut(ring, told, cut: int):
    estimates, folder = told
    slam = load(folder / str(cut))
    for k in range(cut, len(ring)):
        estimate = slam.update(ring[k])
        assert estimate.map_from_robot == estimates[k].map_from_robot
        assert estimate.insert == estimates[k].insert
        assert (estimate.grid is None) == (estimates[k].grid is None and k > cut)
