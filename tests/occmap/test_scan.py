"""What scans and observations refuse to be made of."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.scan import Observation, Scan
from tests.scans import AHEAD, beams


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_none_is_refused_by_name(time_s):
    with pytest.raises(ValueError, match=f"time_s must be finite, got {time_s}"):
        Observation(time_s, Pose2.identity(), beams(AHEAD, [1.0]), Pose2.identity())


def test_a_beam_without_a_direction_is_refused_by_name():
    with pytest.raises(ValueError, match=r"bearings_rad must be finite, .*got nan of beam 1"):
        beams([0.0, math.nan, 1.0], [1.0, math.nan, 1.0])


def test_a_beam_without_an_instant_is_refused_by_name():
    with pytest.raises(ValueError, match=r"beam_times_s must be finite, .*got inf of beam 0"):
        Scan(np.zeros(2), np.ones(2), 12.0, beam_times_s=np.array([math.inf, 0.0]))


def test_a_scan_may_be_empty():
    assert beams([], []).hits_in_lidar().shape == (0, 2)
