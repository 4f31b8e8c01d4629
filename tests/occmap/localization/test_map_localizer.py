"""What a robot that maps nothing learns on the way, and what it keeps."""

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import SlamConfig, SlamLocalizer
from occmap.localization.loop_closure import LoopClosureConfig
from occmap.localization.map_localizer import MapLocalizer
from tests.occmap.localization.drives import RING, RING_LAP, drive, observe

LAP = drive([*RING_LAP, RING_LAP[0]])
NOTHING = np.array([(90.0, 90.0, 91.0, 91.0)])


@pytest.fixture
def finished():
    """A lap, of whose submaps at most three stay ready."""
    slam = SlamLocalizer(SlamConfig(loops=LoopClosureConfig(submaps_in_memory=3)))
    for seen in observe(RING, LAP, np.random.default_rng(0)):
        slam.update(seen)
    slam.finish()
    return slam


@pytest.mark.parametrize(("boxes", "is_confirmed"), [(RING, True), (NOTHING, False)])
def test_wheels_are_confirmed_by_scans_alone(finished, boxes, is_confirmed):
    """Lost, the robot goes as they say: that bears out nothing."""
    localizer = MapLocalizer(finished, Pose2.identity())
    erred = localizer._motion._distrust_m
    erred.mean_square = 25.0
    for seen in observe(boxes, LAP[:100], np.random.default_rng(1)):
        localizer.update(seen)
    assert localizer.is_lost != is_confirmed
    assert (erred.mean_square < 25.0) == is_confirmed


def test_where_it_is_found_the_robot_is_where_it_has_driven_to_meanwhile(finished):
    """It was looked for where its first scan was taken, half a lap from where it believed to be."""
    localizer, lap = MapLocalizer(finished), LAP[len(LAP) // 2 :]
    for pose, seen in zip(lap, observe(RING, lap, np.random.default_rng(1)), strict=True):
        estimate = localizer.update(seen)
        if not localizer.is_lost:
            assert pose.distance_to(lap[0]) > 0.2
            assert estimate.map_from_robot.distance_to(LAP[0].inverse() @ pose) < 0.1
            return
    raise AssertionError("the robot was never found")


def test_submaps_far_behind_give_up_their_memory(finished):
    localizer = MapLocalizer(finished, Pose2.identity())
    for seen in observe(RING, LAP, np.random.default_rng(1)):
        localizer.update(seen)
        assert sum(submap._surfels is not None for submap in finished.tracker.submaps) <= 3
    assert not localizer.is_lost
    assert len(finished.tracker.submaps) > 6
