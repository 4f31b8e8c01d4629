"""Pictures of the world, taken in a process of its own.

MuJoCo looks for its graphics library while it is imported, and cannot be imported at all where that library
is missing. So this process never asks for one: it sends poses to a child that does, and gets pictures back.
A picture of 640 x 480 costs some 40 ms without a graphics card: film a run of ten minutes after it has ended,
one picture every two seconds, and the film costs twelve seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from occmap.geometry import Pose2
from sim.building import Building
from sim.render_process import READY
from sim.scene import yaw_quaternion

Rgb8 = NDArray[np.uint8]
"""(h, w, 3) a picture, row 0 at the top."""

BACKENDS = ("egl", "osmesa")
"""Graphics without a screen, the faster one first."""


class Studio:
    """A camera over a world."""

    def __init__(
        self, child: subprocess.Popen[bytes], model: mujoco.MjModel, size_px: tuple[int, int]
    ) -> None:
        self._child = child
        self._size_px = size_px
        self._wheels = model.qpos0[7:].tolist()
        self._doors = model.nmocap

    def overview(self, world_from_robot: Pose2, door_heights_m: Sequence[float] = ()) -> Rgb8:
        """The whole building from above, the robot in it."""
        heights_m = list(door_heights_m) or [0.0] * self._doors
        if len(heights_m) != self._doors:
            raise ValueError(f"this world has {self._doors} closing doors, got heights of {len(heights_m)}")
        body = [world_from_robot.x_m, world_from_robot.y_m, 0.0, *yaw_quaternion(world_from_robot.yaw_rad)]
        order = np.array([*body, *self._wheels, *heights_m])
        stdin, stdout = self._child.stdin, self._child.stdout
        assert stdin is not None
        assert stdout is not None
        stdin.write(order.tobytes())
        stdin.flush()
        width, height = self._size_px
        picture = stdout.read(3 * width * height)
        if len(picture) < 3 * width * height:
            raise RuntimeError(f"the rendering process ended with exit status {self._child.wait()}")
        return np.frombuffer(picture, dtype=np.uint8).reshape(height, width, 3)

    def close(self) -> None:
        """Let the child go."""
        self._child.communicate()

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_studio(model: mujoco.MjModel, building: Building, size_px: tuple[int, int]) -> Studio | None:
    """A studio for pictures of `size_px` (width, height), or None where no graphics are to be had.

    The model is that of a whole building: `building_scene(building, world.closing).compile()`.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "world.mjb"
        mujoco.mj_saveModel(model, str(file), None)
        for backend in BACKENDS:
            child = _spawn(backend, [str(file), *map(str, size_px), *_view(building, size_px)])
            assert child.stdout is not None
            if child.stdout.readline() == READY:
                return Studio(child, model, size_px)
            child.communicate()
    return None


def _spawn(backend: str, arguments: list[str]) -> subprocess.Popen[bytes]:
    source = str(Path(__file__).resolve().parent.parent)
    paths = os.pathsep.join(filter(None, (source, os.environ.get("PYTHONPATH"))))
    return subprocess.Popen(
        [sys.executable, "-m", "sim.render_process", *arguments],
        env={**os.environ, "MUJOCO_GL": backend, "PYTHONPATH": paths},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # a Ctrl-C at the terminal is for the parent, whose film this finishes
    )


def _view(building: Building, size_px: tuple[int, int]) -> list[str]:
    """Middle of the building, and how many metres of it a picture must show from bottom to top."""
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    seen_m = 1.06 * max(y1 - y0, (x1 - x0) * size_px[1] / size_px[0])
    return [str(0.5 * (x0 + x1)), str(0.5 * (y0 + y1)), str(seen_m)]
