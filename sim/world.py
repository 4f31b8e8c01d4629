"""A building with a robot in it, moved by physics alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import mujoco

from occmap.geometry import Pose2, Twist2
from sim.building import Box, Building, Door
from sim.collisions import Collisions
from sim.doors import ClosingDoors, doors_to_close
from sim.faults import FaultsConfig, PhysicsFault
from sim.lift import Lift
from sim.near_walls import NearWalls, most_around_a_place
from sim.scene import add_solid, building_scene
from sim.solids import Nearby, SolidArrays
from sim.trail import Trail, yaw_of

MAX_CLEARANCE_M = 5.0
"""Nothing farther away than this is looked at when the body's clearance is measured."""


class World:
    """Steps the physics, counts collisions at every step, and lets the configured mishaps happen.

    `drive` sets the speeds that the two wheel motors aim for; nothing else moves the robot.
    """

    def __init__(self, building: Building, faults: FaultsConfig | None = None) -> None:
        self.building = building
        self.faults = faults or FaultsConfig()
        self.solids = SolidArrays.of(building.solids)
        self._nearby = Nearby(self.solids, MAX_CLEARANCE_M)
        self.closing: Sequence[Door] = ()
        if self.faults.close_doors_at_s is not None:
            self.closing = doors_to_close(building.doors, self.faults.close_doors)
        self.model = _compile(building, self.closing, most_around_a_place(self.solids))
        self.data = mujoco.MjData(self.model)
        self._walls = NearWalls(self.model, self.data, self.solids)
        mujoco.mj_forward(self.model, self.data)
        self.doors = ClosingDoors(self.closing)
        self.collisions = Collisions(self.model.opt.timestep)
        self.step_s: float = self.model.opt.timestep
        self.body_radius_m, self.wheel_radius_m, self.track_m = _dimensions(self.model)
        self.wheel_limit_radps = float(self.model.actuator_ctrlrange[:, 1].min())
        self._steps = 0
        self._qpos, self._ctrl = self.data.qpos, self.data.ctrl  # views: each look-up would make another
        self._here: Pose2 | None = None
        self.trail = Trail()
        self.trail.record(self.time_s, self._qpos.tolist())
        self._lift = Lift(self.model)
        self._touching = self.data.sensor("touching").data
        self._warnings = self.data.warning.number
        self._wheels = [int(self.model.joint(name).qposadr[0]) for name in ("left_wheel", "right_wheel")]

    @property
    def time_s(self) -> float:
        """Seconds since the world began."""
        return self._steps * self.step_s  # data.time adds up rounding errors

    @property
    def world_from_robot(self) -> Pose2:
        """Where the robot truly is."""
        if self._here is None:
            pose = self._qpos.tolist()
            self._here = Pose2(pose[0], pose[1], yaw_of(pose))
        return self._here

    @property
    def twist(self) -> Twist2:
        """How the body truly moves: forward and about the vertical."""
        vx, vy, _, _, _, wz = self.data.qvel[:6].tolist()
        yaw = self.world_from_robot.yaw_rad
        return Twist2(vx * math.cos(yaw) + vy * math.sin(yaw), wz)

    @property
    def wheel_angles_rad(self) -> tuple[float, float]:
        """How far the left and the right wheel have turned since the world began."""
        left, right = self._wheels
        return float(self._qpos[left]), float(self._qpos[right])

    @property
    def panels(self) -> SolidArrays:
        """Closing doors as far as they stand in the way now."""
        return self.doors.standing

    def lidar_mount(self) -> tuple[Pose2, float]:
        """robot_from_lidar, and the lidar's height above the floor in metres."""
        site = self.model.site("lidar")
        x, y, height = site.pos.tolist()
        return Pose2(x, y, yaw_of([x, y, height, *site.quat.tolist()])), height

    def clearance_m(self) -> float:
        """From the body to the nearest solid, at most 5 m; slightly negative while pressed on one."""
        x_m, y_m = self.world_from_robot.position
        near = [self._nearby.around(x_m, y_m), self.panels]
        gaps = [solids.distance_m(x_m, y_m).min() - self.body_radius_m for solids in near if len(solids)]
        return float(min([MAX_CLEARANCE_M, *gaps]))

    def drive(self, left_radps: float, right_radps: float) -> None:
        """Set the speeds that the wheels' motors aim for."""
        self._ctrl[0] = left_radps
        self._ctrl[1] = right_radps

    def advance(self, steps: int) -> None:
        """Let a number of physics steps pass, and raise PhysicsFault if something is wrong afterwards."""
        self._let_things_happen(steps * self.step_s)
        self._walls.surround(*self._qpos[:2].tolist())
        self._here = None
        model, data, touching, step = self.model, self.data, self._touching, mujoco.mj_step
        for _ in range(steps):  # in Python: one call for all steps would hide the contacts in between
            step(model, data)
            if touching[0]:
                self.collisions.count(data.time)
        self._steps += steps
        state = self._qpos.tolist()
        self.trail.record(self.time_s, state)
        if any(self._warnings.tolist()) or not math.isfinite(sum(state)):
            self._raise_fault(state)

    def _let_things_happen(self, dt_s: float) -> None:
        faults = self.faults
        if faults.lift_at_s is not None:
            self._lift.set(self.data, faults.lifted(self.time_s))
        if faults.close_doors_at_s is None or self.time_s < faults.close_doors_at_s or self.doors.all_closed:
            return
        here = self.world_from_robot
        self.doors.advance(dt_s, here.x_m, here.y_m, self.body_radius_m)
        self.data.mocap_pos[:, 2] = self.doors.height_m

    def _raise_fault(self, state: list[float]) -> NoReturn:
        reasons = [name for name, kind in _WARNINGS.items() if self._warnings[kind]]
        raise PhysicsFault(
            f"physics fault at t = {self.time_s:.3f} s: {', '.join(reasons) or 'state not finite'}; "
            f"qpos = {state}, qvel = {self.data.qvel.tolist()}"
        )


# World turns every warning into a PhysicsFault; MuJoCo's own handler would also leave a log file behind.
mujoco.set_mju_user_warning(lambda message: None)

_WARNINGS = {name: int(kind) for name, kind in mujoco.mjtWarning.__members__.items() if name != "mjNWARNING"}


def _dimensions(model: mujoco.MjModel) -> tuple[float, float, float]:
    """The radius of the cylinder that encloses the robot, the radius of its wheels, and their distance."""
    left, right = model.body("left_wheel"), model.body("right_wheel")
    return (
        float(model.geom("chassis").size[0]),
        float(model.geom("left_wheel").size[0]),
        float(left.pos[1] - right.pos[1]),
    )


def _compile(building: Building, closing: Sequence[Door], slots: int) -> mujoco.MjModel:
    """The robot, the panels that will close, and slots for the solids around the robot (see NearWalls)."""
    spec = building_scene(replace(building, solids=()), closing)
    for geom in [geom for geom in spec.geoms if geom.contype == geom.conaffinity == geom.mass == 0.0]:
        spec.delete(geom)  # what is only looked at: every geom costs a step some time
    for number in range(slots):
        add_solid(spec.worldbody, Box(0.0, 0.0, 1.0, 1.0)).name = f"slot_{number}"
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE  # its tree knows nothing of slots
    return spec.compile()
