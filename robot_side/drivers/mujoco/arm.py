"""Simulated arm: its physics has its own clock, its commands expire, and it measures with sensors' errors."""

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.clock import Clock
from common.errors import FeelaheadError
from robot_side.arm.limits import ArmLimits, JointLimits
from robot_side.arm.port import ArmState
from robot_side.drivers.mujoco.drives.actuators import moves_any
from robot_side.drivers.mujoco.drives.joint_drives import hold_idle
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, measure_gripper
from robot_side.drivers.mujoco.hand.gripper_drive import GRIPPER, GRIPPER_INPUT, GripperDrive
from robot_side.drivers.mujoco.hand.gripper_sweep import STROKE_TIME_S
from robot_side.drivers.mujoco.joint_reference import WINDUP_RAD, JointReference
from robot_side.drivers.mujoco.plant import PLANT, Plant, drive, inertia_table, sense
from robot_side.drivers.mujoco.scene import Scene

_LONGEST_ADVANCE_S = 2.0
LONGEST_TURN_S: Final = 0.02
"""Longest time, in seconds, for which slow physics may delay messages, stops and leases"""
_LIMIT_MARGIN_RAD = 0.005
_NO_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
# Bad positions, velocities and accelerations, which are neighbours among MuJoCo's warnings.
_UNSTABLE = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)


class Stand(NamedTuple):
    """What is known of the arm at its start, with the gripper open."""

    travel: GripperTravel | None
    """Travel of the gripper; None without a gripper"""
    ends_rad: tuple[FloatArray, FloatArray]
    """Lower and upper ends of the joints' ranges, (n,) each"""


def stand(scene: Scene) -> Stand:
    """Open the gripper at the scene's start; ConfigurationError if the range of its inputs is not known."""
    robot, data, travel = scene.robot, scene.data, measure_gripper(scene)
    if travel is not None:
        data.qpos[robot.finger_positions] = travel.open_fingers
    start = data.qpos[robot.arm_positions]
    # A servo that stops at full deceleration overshoots; at the model's own limit it would hit the stop.
    lowest = np.minimum(robot.lower_rad + _LIMIT_MARGIN_RAD, start)
    return Stand(travel, (lowest, np.maximum(robot.upper_rad - _LIMIT_MARGIN_RAD, start)))


class MujocoArm:
    """Arm in MuJoCo: it moves, decelerates and stops by its own physics clock, with or without ticks.

    It advances the only live state of the scene, so a scene has one arm.
    """

    def __init__(
        self,
        scene: Scene,
        encoder: Encoder,
        limits: JointLimits | None = None,
        gripper_stroke_time_s: float = STROKE_TIME_S,
        windup_rad: float = WINDUP_RAD,
    ) -> None:
        """Begin at the scene's start, with the gripper open. limits: the default ones if None.

        ConfigurationError for a gripper actuator whose range of inputs is not known.
        """
        self._model, self._data, self._robot = scene.model, scene.data, scene.robot
        self._encoder = encoder
        model, data, robot = self._model, self._data, self._robot
        self._step_s = float(model.opt.timestep)
        self._origin_s: float | None = None
        self._steps = 0
        self._skipped = 0
        self._taken = 0, 0
        self._clock: Clock | None = None
        self._state: ArmState | None = None
        self.after_step: Callable[[], object] | None = None
        """Called after each step of the physics"""

        self.travel, self.ends_rad = stand(scene)
        travel = self.travel
        self._gripper = None if travel is None else GripperDrive(travel, gripper_stroke_time_s)
        start = data.qpos[robot.arm_positions].copy()
        limits = limits or ArmLimits().of_joints(len(robot.arm_joints))
        friction, dry = (values[robot.arm_velocities] for values in (model.dof_damping, model.dof_frictionloss))
        leads_rad = robot.drives.windup_rad(windup_rad, dry)
        self._reference = JointReference(start, *self.ends_rad, limits, leads_rad, robot.drives.yield_rad())
        mujoco.mj_forward(model, data)
        of_arm = [actuator for actuator in range(model.nactuator) if moves_any(model, actuator, robot.arm_joints)]
        hold_idle(model, data, np.union1d(of_arm, robot.gripper_actuators).astype(np.int64))
        # MuJoCo's arrays keep their addresses; fetching one costs more than its use in a step.
        self._unstable = data.warning.number[_UNSTABLE]
        self._borne_nm = data.qfrc_constraint
        self._rubbing = np.flatnonzero(model.dof_frictionloss > 0.0)
        self._rubs = np.isin(robot.arm_velocities, self._rubbing)
        gripper, driven = self._gripper, robot.gripper_actuators
        self._plant = Plant(
            self._reference.joints,
            robot.drives.table(friction, dry),
            robot.drives.inputs(),
            inertia_table(model, robot.arm_velocities),
            np.zeros(0, GRIPPER) if gripper is None else gripper.drive,
            np.zeros((0, 4)) if gripper is None else gripper.samples,
            np.zeros(0, GRIPPER_INPUT) if gripper is None else gripper.inputs(robot.gripper_controls, driven),
            robot.arm_positions.astype(np.int64),
            robot.finger_positions.astype(np.int64),
            robot.arm_velocities.astype(np.int64),
            data.qpos,
            data.qvel,
            data.M,
            data.qfrc_bias,
            data.qfrc_gravcomp,
            data.qfrc_spring,
            data.actuator_length,
            data.actuator_velocity,
            data.ctrl,
        )
        self._addresses = PLANT.bundle(self._plant)
        self._start = mujoco.MjData(model)
        mujoco.mj_copyData(self._start, model, data)
        self._started = [
            (array, array.copy()) for array in (self._plant.joints, self._plant.drives, self._plant.grippers)
        ]

    @property
    def joint_count(self) -> int:
        """Number n of joints between the base and the tool."""
        return len(self._robot.arm_joints)

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `joint_velocity_rad_s` (n,) until `valid_until_s`, then decelerate from the measured state.

        If one is above the arm's limit, all velocities are scaled by the same factor. ValueError for a wrong shape or a
        value that is not finite; nothing of such a command is applied.
        """
        self._reference.command(joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Move the gripper until `valid_until_s`; closing: share of its full speed, +1 closes, 0 holds, -1 opens.

        An arm without a gripper ignores the call. ValueError for a value outside [-1, 1] or a time that is not finite.
        """
        if self._gripper is not None:
            self._gripper.command(closing, valid_until_s)

    def put_back(self) -> None:
        """Put the arm, the gripper and all objects back to their start, at rest; commands so far have expired."""
        data, time_s = self._data, self._data.time
        mujoco.mj_copyData(data, self._model, self._start)
        data.time = time_s
        for array, start in self._started:
            array[:] = start
        self._reference.expire()
        if self._gripper is not None:
            self._gripper.command(0.0, self._time_s)
        self._state = None

    def rehearse(self, joint_velocity_rad_s: FloatArray, duration_s: float) -> FloatArray:
        """Command `joint_velocity_rad_s` (n,) for `duration_s` in empty space, and put all back.

        Return the true joint positions (k, n) after each step. Only before the first `state`.
        """
        model, data = self._model, self._data
        flags, model.opt.disableflags = model.opt.disableflags, model.opt.disableflags | _NO_CONTACT
        self._reference.command(joint_velocity_rad_s, duration_s)
        path: list[FloatArray] = []
        for _ in range(round(duration_s / self._step_s)):
            self._advance_one_step()
            path.append(data.qpos[self._robot.arm_positions])
        model.opt.disableflags, self._steps = flags, 0
        self.put_back()
        data.time = self._start.time
        return np.array(path)

    def give_way(self, clock: Clock) -> None:
        """Limit each later call of `state` to LONGEST_TURN_S and one step, by `clock`.

        Further steps that are due are skipped: the simulation falls behind real time.
        """
        self._clock = clock

    def state(self, now_s: float) -> ArmState:
        """Advance the physics to `now_s` and return the measured state; the first call synchronises the clocks.

        At most 2 s are simulated at once. After a longer gap the rest is skipped, as if the world had paused.
        FeelaheadError if the simulation has become unstable or MuJoCo fails.
        """
        if self._origin_s is None:
            self._origin_s = now_s
        # A tolerance, so that a tick of the timestep's period never misses its step by rounding.
        due = math.floor((now_s - self._time_s) / self._step_s + 1e-6)
        run = self._advance(min(due, round(_LONGEST_ADVANCE_S / self._step_s)))
        if run > 0:
            self._origin_s += (due - run) * self._step_s
            self._skipped += due - run
            self._require_stable()
        if run > 0 or self._state is None:
            self._state = self._measure()
        return self._state

    @property
    def share_of_real_time(self) -> float:
        """Simulated time since the first `state`, as a share of real time: 1 unless the physics is too slow."""
        return _share(self._steps, self._skipped)

    def take_share_of_real_time(self) -> float:
        """Return the simulated time since the last call, as a share of real time."""
        (steps, skipped), self._taken = self._taken, (self._steps, self._skipped)
        return _share(self._steps - steps, self._skipped - skipped)

    @property
    def _time_s(self) -> float:
        """Present time of the physics, on the caller's clock."""
        return (self._origin_s or 0.0) + self._steps * self._step_s

    def _advance(self, due: int) -> int:
        """Simulate up to `due` steps, and at least one if any is due; return their number."""
        clock, ends_s = self._clock, 0.0
        if clock is not None and due > 1:
            ends_s = clock.now() + LONGEST_TURN_S
        try:
            for step in range(1, due + 1):
                self._advance_one_step()
                if clock is not None and step < due and clock.now() >= ends_s:
                    return step
        except mujoco.FatalError as error:
            raise FeelaheadError(f"MuJoCo gave up: {' '.join(str(error).split())}") from error
        return max(due, 0)

    def _advance_one_step(self) -> None:
        time_s = self._time_s
        closing = 0.0 if self._gripper is None else self._gripper.commanded_at(time_s)
        drive(self._addresses, *self._reference.follows(time_s), closing, self._step_s)
        mujoco.mj_step(self._model, self._data)
        self._steps += 1
        if self.after_step is not None:
            self.after_step()

    def _measure(self) -> ArmState:
        plant, gripper, encoder = self._plant, self._gripper, self._encoder
        positions, fingers = encoder.noise(plant.positions.size), encoder.noise(plant.fingers.size)
        velocities = np.empty(plant.velocities.size)
        sense(self._addresses, encoder.sigma_rad, encoder.resolution_rad, positions, velocities, fingers)
        return ArmState(
            time_s=self._time_s,
            joint_positions_rad=positions,
            joint_velocities_rad_s=velocities,
            finger_positions=fingers,
            gripper_opening_m=0.0 if gripper is None else gripper.opening_m,
            gripper_holding=gripper is not None and gripper.holding,
            joint_loads_nm=self._loads_nm(),
            simulated_s=self._steps * self._step_s,
        )

    def _loads_nm(self) -> FloatArray:
        """Return the loads (n,) beyond the joints' own dry friction, as sensors behind the gears measure them."""
        loads_nm: FloatArray = -self._borne_nm[self._plant.velocities]
        if self._rubs.any():
            # MuJoCo's constraints: equalities first, then the dry friction of each velocity that has any.
            rubbing = self._data.efc_force[self._data.ne :][: self._rubbing.size]
            loads_nm[self._rubs] += rubbing[np.searchsorted(self._rubbing, self._plant.velocities[self._rubs])]
        return loads_nm

    def _require_stable(self) -> None:
        # MuJoCo resets an unstable simulation to its start, which must not count as a motion of the arm.
        if np.count_nonzero(self._unstable):
            raise FeelaheadError(
                f"the simulation became unstable at {self._data.time:.3f} s; a smaller timestep in the model may help"
            )


def _share(steps: int, skipped: int) -> float:
    return steps / (steps + skipped) if steps + skipped else 1.0
