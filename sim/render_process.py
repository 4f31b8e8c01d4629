"""The child that draws: poses come in on its standard input, pictures leave on its standard output.

Started by sim.render with MUJOCO_GL set: python -m sim.render_process MODEL WIDTH HEIGHT X Y METRES
"""

from __future__ import annotations

import math
import sys

import mujoco
import numpy as np

READY = b"ready\n"
FIELD_OF_VIEW_DEG = 20.0
"""Narrow and from far away: walls of far rooms lean little."""
ROOM_FOR_MORE = 100
"""Things to draw beyond the model's own geoms. MuJoCo's default is 10,000 in all: ragged plans have more."""


def overview_camera(x_m: float, y_m: float, seen_m: float) -> mujoco.MjvCamera:
    """Straight down on the building, +y up in the picture, so that it can stand beside a map."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = (x_m, y_m, 0.0)
    camera.distance = 0.5 * seen_m / math.tan(0.5 * math.radians(FIELD_OF_VIEW_DEG))
    camera.azimuth, camera.elevation = 90.0, -89.9
    return camera


def mark(scene: mujoco.MjvScene, place_m: np.ndarray, radius_m: float) -> None:
    """A disc over the robot, which alone would be a few pixels in a picture of a whole building."""
    height_m = 1.2  # over the walls, so that none hides it
    mujoco.mjv_initGeom(
        scene.geoms[scene.ngeom],
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=np.array([radius_m, 0.01, 0.0]),
        pos=np.array([place_m[0], place_m[1], height_m]),
        mat=np.eye(3).ravel(),
        rgba=np.array([0.0, 0.38, 1.0, 1.0], dtype=np.float32),
    )
    scene.ngeom += 1


def main(file: str, width: int, height: int, x_m: float, y_m: float, seen_m: float) -> None:
    """Draw until the input ends."""
    model = mujoco.MjModel.from_binary_path(file)
    overview = overview_camera(x_m, y_m, seen_m)
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.global_.fovy = FIELD_OF_VIEW_DEG
    # Both planes count in extents of the model, which depend on the building.
    model.vis.map.znear = 1.0 / model.stat.extent
    model.vis.map.zfar = 2.0 * overview.distance / model.stat.extent + 10.0
    body_radius_m = float(model.geom("chassis").size[0])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    orders, pictures = sys.stdin.buffer, sys.stdout.buffer
    with mujoco.Renderer(model, height, width, max_geom=model.ngeom + ROOM_FOR_MORE) as renderer:
        pictures.write(READY)
        pictures.flush()
        size = 8 * (model.nq + model.nmocap)
        while len(order := orders.read(size)) == size:
            state = np.frombuffer(order)
            data.qpos[:] = state[: model.nq]
            data.mocap_pos[:, 2] = state[model.nq :]
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, overview)
            mark(renderer.scene, data.qpos[:2], max(body_radius_m, seen_m / 60.0))
            pictures.write(renderer.render().tobytes())
            pictures.flush()


if __name__ == "__main__":
    _, model_file, *given = sys.argv
    main(model_file, int(given[0]), int(given[1]), *map(float, given[2:]))
