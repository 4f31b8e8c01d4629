"""What an observation refuses to be made of."""

from __future__ import annotations

import math

import pytest

from occmap.geometry import Pose2
from occmap.scan import Observation
from tests.scans import AHEAD, beams


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_none_is_refused_by_name(time_s):
    with pytest.raises(ValueError, match=f"time_s must be finite, got {time_s}"):
        Observation(time_s, Pose2.identity(), beams(AHEAD, [1.0]), Pose2.identity())
