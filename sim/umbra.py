"""Which solids cannot be seen, because one other stands in front of all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.solids import Floats, SolidArrays

OCCLUDERS = 64
"""Only the solids that look largest are tried: the cost is this many times the number of solids."""
LEAST_ANGLE_RAD = 0.02
"""What looks smaller than this is not worth trying."""


def hidden(solids: SolidArrays, x_m: float, y_m: float, wander_m: float) -> NDArray[np.bool_]:
    """(n,) whether a solid is out of sight from every point within wander_m of a place.

    Were that disc a lamp, a wall's umbra would be the region behind it that no part of the lamp lights:
    beyond the wall, and beyond the line through each of its ends that touches the lamp on the other end's
    side. A solid wholly inside is hidden (strong occlusion: Cohen-Or et al., "Conservative visibility and
    strong occlusion for viewspace partitioning of densely occluded scenes", 1998). Shadows that only several
    walls cast together are missed: the answer errs towards "seen". 0.3 ms for 100 solids.
    """
    left, right = _ends(solids, np.array([x_m, y_m]), wander_m)
    moved = solids.center_m - (x_m, y_m)
    shaded = _beyond(solids, moved, left, _right_of(_tangents(left, -wander_m)))
    shaded &= _beyond(solids, moved, right, -_right_of(_tangents(right, wander_m)))
    shaded &= _beyond(solids, moved, left, _right_of(left - right))
    return np.any(shaded, axis=0)


def _ends(solids: SolidArrays, place_m: Floats, wander_m: float) -> tuple[Floats, Floats]:
    """Left and right ends (m, 2), seen from a place and relative to it, of the long axes of the solids that
    look largest among those that the disc does not reach."""
    along_x = solids.half_m[:, 0] >= solids.half_m[:, 1]
    axis = np.where(along_x[:, None], solids.heading, _left_of(solids.heading))
    reach = axis * solids.half_m.max(axis=1)[:, None]
    one, other = solids.center_m + reach - place_m, solids.center_m - reach - place_m
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    left = np.where((cross < 0.0)[:, None], one, other)
    right = np.where((cross < 0.0)[:, None], other, one)
    with np.errstate(invalid="ignore", divide="ignore"):
        distance_m = np.abs(cross) / np.linalg.norm(left - right, axis=1)  # nan for cylinders
        angle_rad = np.arctan2(np.abs(cross), (left * right).sum(axis=1))
    angle_rad[~(distance_m > wander_m + 1e-6)] = 0.0
    largest = np.argsort(-angle_rad, kind="stable")[:OCCLUDERS]
    chosen = largest[angle_rad[largest] > LEAST_ANGLE_RAD]
    return left[chosen], right[chosen]


def _tangents(ends: Floats, radius_m: float) -> Floats:
    """(m, 2) unit vectors to (m, 2) ends, turned left until their lines touch the disc about the origin."""
    length = np.linalg.norm(ends, axis=1)
    sine = radius_m / length
    cosine = np.sqrt(1.0 - sine**2)
    return (cosine[:, None] * ends + sine[:, None] * _left_of(ends)) / length[:, None]


def _beyond(solids: SolidArrays, moved: Floats, points: Floats, normals: Floats) -> NDArray[np.bool_]:
    """(m, n) whether the whole of each solid lies beyond each line through a point with a normal."""
    nearest = normals @ moved.T
    nearest -= np.abs(normals @ solids.heading.T) * solids.half_m[:, 0]
    nearest -= np.abs(normals @ _left_of(solids.heading).T) * solids.half_m[:, 1]
    nearest -= np.linalg.norm(normals, axis=1)[:, None] * solids.radius_m
    return nearest > (normals * points).sum(axis=1)[:, None] + 1e-9


def _left_of(vectors: Floats) -> Floats:
    return np.column_stack((-vectors[:, 1], vectors[:, 0]))


def _right_of(vectors: Floats) -> Floats:
    return np.column_stack((vectors[:, 1], -vectors[:, 0]))
