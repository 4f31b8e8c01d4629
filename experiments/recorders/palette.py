"""The colours that the recording, the video and the plots share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]

# The belief wears RViz's map colours, which roboticists read without a legend.
UNKNOWN: Rgb = (112, 137, 134)
FREE: Rgb = (255, 255, 255)
OCCUPIED: Rgb = (0, 0, 0)
BELIEF: NDArray[np.uint8] = np.array([UNKNOWN, FREE, OCCUPIED], np.uint8)
"""(3, 3) colour of each value of `occmap.grid.Belief`."""

ROBOT: Rgb = (0, 98, 255)
TRAIL: Rgb = (70, 140, 255)
TRUE_ROBOT: Rgb = (0, 150, 70)
TRUE_TRAIL: Rgb = (60, 175, 105)
PATH: Rgb = (255, 128, 0)
GOAL: Rgb = (230, 0, 120)
HIT: Rgb = (235, 55, 35)
HIT_RAY: Rgb = (246, 178, 168)
NO_RETURN: Rgb = (165, 205, 240)
TRUTH: Rgb = (200, 30, 200)
INK: Rgb = (32, 36, 42)
FLOOR: Rgb = (236, 236, 232)

FRONTIERS: tuple[Rgb, ...] = ((0, 168, 150), (124, 92, 216), (60, 160, 40), (0, 140, 205), (176, 132, 0))
"""Clusters take turns; the chosen one wears GOAL instead."""

SOLIDS: dict[str, Rgb] = {
    "wall": (150, 158, 170),
    "column": (128, 128, 138),
    "furniture": (186, 140, 96),
    "shelf": (140, 112, 86),
}
DOOR: Rgb = (204, 69, 56)
OTHER_SOLID: Rgb = (160, 150, 140)

ACTIVITIES: dict[str, Rgb] = {
    "exploring": ROBOT,
    "looking": (0, 150, 160),
    "thinking": (110, 110, 190),
    "recovering": PATH,
    "blind": (120, 120, 120),
    "lost": (200, 120, 160),
    "complete": (30, 160, 70),
    "sealed_in": (140, 90, 200),
    "stuck": (215, 40, 40),
}
"""By `Decision.activity`."""
