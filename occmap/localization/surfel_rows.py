"""The rows that surfels are kept in: arrays (n, COLUMNS), for kernels and their callers alike."""

from __future__ import annotations

MEAN_X, MEAN_Y, NORMAL_X, NORMAL_Y, FLATNESS, COUNT, VIEW_X, VIEW_Y = range(8)
"""Columns of a row: the mean of all its points in metres, the unit normal of the wall, flatness (1 less the
ratio of thin to long variance), the number of points, the mean unit vector towards the sensor (the view)."""
COLUMNS = 8
MEAN, NORMAL, VIEW = slice(MEAN_X, MEAN_Y + 1), slice(NORMAL_X, NORMAL_Y + 1), slice(VIEW_X, VIEW_Y + 1)
"""The columns of each vector."""

TOO_LITTLE = -1.0
"""Flatness of a surfel that too few points tell about."""
NO_NORMAL = 0.0
"""Flatness of a blob."""
FLAT = 0.5
"""From this flatness on a surfel is a piece of a wall."""
MOST_COUNT = 20.0
"""A surfel of more points than this weighs no more: it is as good as its voxel."""
