"""Kernels of the fine match: a map of surfels (little pieces of wall) and Gauss-Newton against it.

A surfel is the mean of all points that fell into one voxel, with the normal of the wall round it,
towards the side that it was seen from: a partition has two faces, and a scan of one must not be
pulled to the other. `index` (ny, nx) int32 holds a voxel's row in `surfels` (capacity, COLUMNS) or -1; what
a row holds is told by surfel_rows. Points and views are in the map's frame unless said otherwise.
"""

from __future__ import annotations

import math

import numpy as np

from occmap.kernel import fast_kernel, kernel, part
from occmap.localization.surfel_rows import (
    COUNT,
    FLAT,
    FLATNESS,
    MEAN_X,
    MEAN_Y,
    MOST_COUNT,
    NO_NORMAL,
    NORMAL_X,
    NORMAL_Y,
    TOO_LITTLE,
    VIEW_X,
    VIEW_Y,
)

LEAST_SUPPORT = 4.0
"""Fewer points tell nothing."""
OTHER_FACE = -0.3
"""Surfels whose views have a smaller scalar product were seen from the two sides of one wall."""
LEAST_VARIANCE_M2 = 0.0025
"""Along its longer axis; a blob of less than 5 cm has no direction."""
FADING = 0.25
"""A surfel d voxels away weighs (1 - FADING d^2)^2: nothing from two voxels on."""
POINT_SHARE = 0.1
"""A distance from a surfel without a normal weighs so much of one off a wall, whichever way it goes."""
ENOUGH_M, ENOUGH_RAD = 1e-3, 1e-4
"""A smaller step ends the iterations at one scale,"""
ENOUGH_AT_LAST_M, ENOUGH_AT_LAST_RAD = 1e-4, 1e-5
"""and at the last of them."""
SINGULAR = 1e-12
"""A determinant no larger than this is taken for none."""
ROUGH_SHARE = 0.3
"""Of the roughness of walls, what may look like information along them: noise tilts their normals."""
OVERSTEP = 1.25
"""Of a Gauss-Newton step, what is taken: as weights follow the points, each step is a quarter too short."""
GRAZING = 0.25
"""Of a beam's variance, what is left across the wall that it only grazes: walls are not quite flat."""


@kernel
def insert(index, surfels, size, points, facing, origin_x, origin_y, voxels_per_m):
    """Average points (n, 2), seen from facing (n, 2), into their voxels, and renew the normals there.

    Returns the new size; the capacity must hold size + n rows. O(points * 25).
    """
    ny, nx = index.shape
    for p in range(points.shape[0]):
        ix = math.floor((points[p, 0] - origin_x) * voxels_per_m)
        iy = math.floor((points[p, 1] - origin_y) * voxels_per_m)
        if ix < 2 or iy < 2 or ix >= nx - 2 or iy >= ny - 2:
            continue
        row = index[iy, ix]
        if row < 0:
            row = size
            index[iy, ix] = row
            surfels[row, :] = 0.0
            size += 1
        surfels[row, COUNT] += 1.0
        surfels[row, MEAN_X] += (points[p, 0] - surfels[row, MEAN_X]) / surfels[row, COUNT]
        surfels[row, MEAN_Y] += (points[p, 1] - surfels[row, MEAN_Y]) / surfels[row, COUNT]
        surfels[row, VIEW_X] += (facing[p, 0] - surfels[row, VIEW_X]) / surfels[row, COUNT]
        surfels[row, VIEW_Y] += (facing[p, 1] - surfels[row, VIEW_Y]) / surfels[row, COUNT]
    for p in range(points.shape[0]):
        ix = math.floor((points[p, 0] - origin_x) * voxels_per_m)
        iy = math.floor((points[p, 1] - origin_y) * voxels_per_m)
        if 2 <= ix < nx - 2 and 2 <= iy < ny - 2:
            _renew_normal(index, surfels, ix, iy)
    return size


@kernel
def renew_normals(index, surfels, size, origin_x, origin_y, voxels_per_m):
    """The normals of all surfels, from all that is known by now."""
    for row in range(size):
        ix = math.floor((surfels[row, MEAN_X] - origin_x) * voxels_per_m)
        iy = math.floor((surfels[row, MEAN_Y] - origin_y) * voxels_per_m)
        _renew_normal(index, surfels, ix, iy)


@kernel
def _renew_normal(index, surfels, ix, iy):
    """Principal axes of the surfels in the 5 x 5 voxels round one; flatness = 1 - thin / long variance."""
    n = 0.0
    sx = sy = sxx = sxy = syy = 0.0
    here = index[iy, ix]
    x0, y0 = surfels[here, MEAN_X], surfels[here, MEAN_Y]
    vx, vy = surfels[here, VIEW_X], surfels[here, VIEW_Y]
    for y in range(iy - 2, iy + 3):
        for x in range(ix - 2, ix + 3):
            row = index[y, x]
            if row >= 0:
                if surfels[row, VIEW_X] * vx + surfels[row, VIEW_Y] * vy < OTHER_FACE:
                    continue  # the other face
                w = min(surfels[row, COUNT], MOST_COUNT)
                dx, dy = surfels[row, MEAN_X] - x0, surfels[row, MEAN_Y] - y0
                n += w
                sx += w * dx
                sy += w * dy
                sxx += w * dx * dx
                sxy += w * dx * dy
                syy += w * dy * dy
    cxx, cxy, cyy = sxx / n - sx * sx / n / n, sxy / n - sx * sy / n / n, syy / n - sy * sy / n / n
    middle, spread = 0.5 * (cxx + cyy), math.hypot(0.5 * (cxx - cyy), cxy)
    thin, long = max(middle - spread, 0.0), middle + spread
    if n < LEAST_SUPPORT:
        surfels[here, FLATNESS] = TOO_LITTLE
        return
    if long < LEAST_VARIANCE_M2:
        surfels[here, FLATNESS] = NO_NORMAL
        return
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy) + 0.5 * math.pi
    nx, ny = math.cos(angle), math.sin(angle)
    if nx * vx + ny * vy < 0.0:
        nx, ny = -nx, -ny
    surfels[here, NORMAL_X], surfels[here, NORMAL_Y] = nx, ny
    surfels[here, FLATNESS] = 1.0 - thin / long


@fast_kernel
def linearise(index, surfels, origin_x, origin_y, voxels_per_m, points, facing, pose, scale, hessian,
              gradient):  # fmt: skip
    """Adds the points' normal equations about pose (x, y, yaw); returns the sum of weights, and the roughness
    (1 - flatness) of the walls that they lie on, in sum, weighted as the hessian is.

    Point-to-line residuals where the surfel is flat, blended into point-to-point where it is not;
    Geman-McClure weights of the given scale (m) let go of what the map does not know. O(points * 9).
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    weight_sum = 0.0
    roughness = 0.0
    fading = FADING * voxels_per_m * voxels_per_m
    for p in range(points.shape[0]):
        rx = c * points[p, 0] - s * points[p, 1]
        ry = s * points[p, 0] + c * points[p, 1]
        x, y = rx + pose[0], ry + pose[1]
        ix = math.floor((x - origin_x) * voxels_per_m)
        iy = math.floor((y - origin_y) * voxels_per_m)
        if ix < 0 or iy < 0 or ix >= index.shape[1] or iy >= index.shape[0]:
            continue
        fx = c * facing[p, 0] - s * facing[p, 1]
        fy = s * facing[p, 0] + c * facing[p, 1]
        total = mxx = mxy = myy = gx = gy = gain = rough = 0.0
        for j in range(max(iy - 1, 0), min(iy + 2, index.shape[0])):
            for i in range(max(ix - 1, 0), min(ix + 2, index.shape[1])):
                row = index[j, i]
                if row < 0:
                    continue
                flat, nx, ny = surfels[row, FLATNESS], surfels[row, NORMAL_X], surfels[row, NORMAL_Y]
                if flat < 0.0 or (flat > FLAT and nx * fx + ny * fy < 0.0):
                    continue  # too little to tell, or the wall's other face
                ex, ey = x - surfels[row, MEAN_X], y - surfels[row, MEAN_Y]
                near = 1.0 - (ex * ex + ey * ey) * fading
                if near <= 0.0:
                    continue
                v = near * near * min(surfels[row, COUNT], MOST_COUNT)
                # the squared residual is e^T M e, M = flat^2 n n^T + (1 - flat) * POINT_SHARE * I
                f2, iso = v * flat * flat, v * POINT_SHARE * (1.0 - flat)
                axx, axy, ayy = f2 * nx * nx + iso, f2 * nx * ny, f2 * ny * ny + iso
                total += v
                rough += v * (1.0 - flat) if flat > FLAT else 0.0
                # errors along a beam are off the wall by its cosine: what grazes a wall tells most
                cosine, flat2 = nx * fx + ny * fy, flat * flat
                gain += v * (1.0 - flat2 + flat2 * (1.0 + GRAZING) / (cosine * cosine + GRAZING))
                mxx += axx
                mxy += axy
                myy += ayy
                gx += axx * ex + axy * ey
                gy += axy * ex + ayy * ey
        if total <= 0.0:
            continue
        mxx, mxy, myy, gx, gy = mxx / total, mxy / total, myy / total, gx / total, gy / total
        r2 = gx * gx + gy * gy
        w = scale * scale / (scale * scale + r2)
        w *= w
        weight_sum += w
        w *= gain / total
        roughness += w * rough / total
        hx, hy = mxx * -ry + mxy * rx, mxy * -ry + myy * rx
        hessian[0, 0] += w * mxx
        hessian[0, 1] += w * mxy
        hessian[1, 1] += w * myy
        hessian[0, 2] += w * hx
        hessian[1, 2] += w * hy
        hessian[2, 2] += w * (hx * -ry + hy * rx)
        gradient[0] += w * gx
        gradient[1] += w * gy
        gradient[2] += w * (gx * -ry + gy * rx)
    return weight_sum, roughness


@part
def forget_weak_axis(hessian, gradient, roughness):
    """Drop what the points tell along their weakest axis, if the roughness of walls could say as much.

    Along a bare corridor noise tells of no motion: each scan would be held back to where the last one was.
    After Zhang, Kaess and Singh, On degeneracy of optimization-based state estimation problems, ICRA 2016,
    who leave such an axis to the prediction; here what counts as degenerate follows the noise.
    """
    middle = 0.5 * (hessian[0, 0] + hessian[1, 1])
    spread = math.hypot(0.5 * (hessian[0, 0] - hessian[1, 1]), hessian[0, 1])
    if middle - spread >= ROUGH_SHARE * roughness:
        return
    angle = 0.5 * math.atan2(2.0 * hessian[0, 1], hessian[0, 0] - hessian[1, 1])
    x, y = math.cos(angle), math.sin(angle)  # the strong axis
    most = middle + spread
    along, turn = gradient[0] * x + gradient[1] * y, hessian[0, 2] * x + hessian[1, 2] * y
    gradient[0], gradient[1] = along * x, along * y
    hessian[0, 0], hessian[0, 1], hessian[1, 1] = most * x * x, most * x * y, most * y * y
    hessian[0, 2], hessian[1, 2] = turn * x, turn * y


@fast_kernel
def refine(index, surfels, origin_x, origin_y, voxels_per_m, points, facing, start, prior, prior_information,
           sigma_m, scales, iterations):  # fmt: skip
    """Gauss-Newton from start (x, y, yaw), pulled to prior by its 3 x 3 information.

    One pass per robust scale, wide to narrow. Returns (pose, information of the points alone,
    sum of robust weights). About 0.05 ms for 180 points.
    """
    pose = start.copy()
    hessian, pulled = np.empty((3, 3)), np.empty((3, 3))
    gradient, offset = np.empty(3), np.empty(3)
    weight = 0.0
    per_point = 1.0 / (sigma_m * sigma_m)
    for k in range(scales.shape[0]):
        is_last = k == scales.shape[0] - 1
        enough_m = ENOUGH_AT_LAST_M if is_last else ENOUGH_M
        enough_rad = ENOUGH_AT_LAST_RAD if is_last else ENOUGH_RAD
        for _ in range(iterations):
            hessian[:, :] = 0.0
            gradient[:] = 0.0
            weight, roughness = linearise(
                index,
                surfels,
                origin_x,
                origin_y,
                voxels_per_m,
                points,
                facing,
                pose,
                scales[k],
                hessian,
                gradient,
            )
            forget_weak_axis(hessian, gradient, roughness)
            hessian[1, 0], hessian[2, 0], hessian[2, 1] = hessian[0, 1], hessian[0, 2], hessian[1, 2]
            offset[0], offset[1] = pose[0] - prior[0], pose[1] - prior[1]
            offset[2] = math.pi - (math.pi - (pose[2] - prior[2])) % (2.0 * math.pi)
            for i in range(3):  # loops: array expressions compile for longer than all the rest
                gradient[i] *= per_point
                for j in range(3):
                    hessian[i, j] *= per_point
                    pulled[i, j] = hessian[i, j] + prior_information[i, j]
                    gradient[i] += prior_information[i, j] * offset[j]
            step = _solve3(pulled, gradient)
            for i in range(3):
                pose[i] -= OVERSTEP * step[i]
            if math.hypot(step[0], step[1]) < enough_m and abs(step[2]) < enough_rad:
                break
    return pose, hessian, weight


@part
def _solve3(a, b):
    """x of a x = b for a symmetric positive definite 3 x 3, by Cramer's rule; zero if it is singular."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c01 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c02 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    x = np.empty(3)
    x[:] = 0.0
    if det <= SINGULAR:
        return x
    c11 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]
    c12 = a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]
    c22 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    x[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / det
    x[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / det
    x[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / det
    return x


@kernel
def reindex(index, surfels, origin_x, origin_y, voxels_per_m):
    """Enter all surfels into an empty index."""
    for row in range(surfels.shape[0]):
        ix = math.floor((surfels[row, MEAN_X] - origin_x) * voxels_per_m)
        iy = math.floor((surfels[row, MEAN_Y] - origin_y) * voxels_per_m)
        index[iy, ix] = row
