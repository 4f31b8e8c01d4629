"""The mishap that leaves a robot spinning its wheels."""

from __future__ import annotations

import mujoco
import numpy as np


class Lift:
    """Hangs the robot up on something: the body is held a centimetre higher and its wheels lose the floor.

    Encoders go on counting while nothing moves, which is what being stuck looks like from inside.
    """

    height_m = 0.01

    def __init__(self, model: mujoco.MjModel) -> None:
        self._weld = model.equality("high_centred").id
        self._model = model
        self.active = False

    def set(self, data: mujoco.MjData, active: bool) -> None:
        """Hold the body above where it is now, or let it go."""
        if active and not self.active:
            pose = data.qpos[:7].copy()
            pose[2] += self.height_m
            self._model.eq_data[self._weld, :10] = _held_at(pose)
        if active != self.active:
            data.eq_active[self._weld] = active
            self.active = active


def _held_at(pose: np.ndarray) -> np.ndarray:
    """What a weld holds that keeps a body's origin at a pose (7 numbers) in the world: the anchor in the
    world, the anchor in the body, and the world's orientation seen from the body."""
    world_in_body = np.zeros(4)
    mujoco.mju_negQuat(world_in_body, pose[3:])
    return np.concatenate((pose[:3], np.zeros(3), world_in_body))
