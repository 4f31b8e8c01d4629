"""Geoms of a compiled MuJoCo model, rewritten in place."""

from __future__ import annotations

import mujoco
import numpy as np

from sim.solids import SolidArrays

_BOX, _CYLINDER = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_CYLINDER)


def write_geoms(model: mujoco.MjModel, data: mujoco.MjData, slots: slice, solids: SolidArrays) -> None:
    """Make the geoms of the worldbody in `slots` the given solids.

    This sets by hand what MuJoCo's compiler and its kinematics would, except for the worldbody's tree of
    bounding volumes: whoever uses slots must do without.
    """
    is_cylinder = solids.radius_m > 0.0
    half_z = 0.5 * solids.height_m
    box = np.column_stack((solids.half_m + solids.radius_m[:, None], half_z))  # also bounds a cylinder
    model.geom_type[slots] = np.where(is_cylinder, _CYLINDER, _BOX)
    model.geom_size[slots] = box
    model.geom_size[slots, 1] = np.where(is_cylinder, half_z, box[:, 1])
    model.geom_aabb[slots, 3:] = box
    model.geom_rbound[slots] = np.linalg.norm(box, axis=1)
    c, s = solids.heading[:, 0], solids.heading[:, 1]
    half_yaw = 0.5 * np.arctan2(s, c)
    zero = np.zeros(len(solids))
    model.geom_pos[slots] = data.geom_xpos[slots] = np.column_stack((solids.center_m, half_z))
    model.geom_quat[slots] = np.column_stack((np.cos(half_yaw), zero, zero, np.sin(half_yaw)))
    model.geom_sameframe[slots] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    data.geom_xmat[slots] = np.column_stack((c, -s, zero, s, c, zero, zero, zero, zero + 1.0))
