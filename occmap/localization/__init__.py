"""Odometry corrected against the map: scan matching, submaps, loop closure, pose graph.

Importing it loads no kernels.
"""

from occmap.localization.localizer import Estimate, Localizer, OdometryLocalizer
from occmap.localization.slam import SlamConfig, SlamLocalizer

__all__ = ["Estimate", "Localizer", "OdometryLocalizer", "SlamConfig", "SlamLocalizer"]
