"""The simulated arm: physics on a clock of its own, commands that run out, and sensors."""

import math

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.errors import FeelaheadError
from robot_side.arm.port import ArmState
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.gripper_drive import GripperDrive
from robot_side.simulation.gripper_measurement import measure_gripper
from robot_side.simulation.joint_reference import JointReference, MotionLimits
from robot_side.simulation.scene import Scene

_LONGEST_ADVANCE_S = 2.0
_LIMIT_MARGIN_RAD = 0.005
_UNSTABLE = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


class MujocoArm:
    """An Arm in MuJoCo: it goes on, decelerates and stops by its own physics clock, ticked or not.

    It advances the scene's one live state, so that there is one arm to a scene.
    """

    def __init__(
        self,
        scene: Scene,
        encoder: Encoder,
        limits: MotionLimits | None = None,
        gripper_stroke_time_s: float = 0.6,
    ) -> None:
        """Stand where the scene starts, with the gripper open.

        ConfigurationError for a gripper actuator whose range of inputs is not known.
        """
        self._model, self._data, self._robot = scene.model, scene.data, scene.robot
        self._encoder = encoder
        model, data, robot = self._model, self._data, self._robot
        self._step_s = float(model.opt.timestep)
        self._origin_s: float | None = None
        self._steps = 0
        self._state: ArmState | None = None

        travel = measure_gripper(scene)
        self._gripper = None if travel is None else GripperDrive(travel, gripper_stroke_time_s)
        if travel is not None:
            data.qpos[robot.finger_positions] = travel.open_fingers
        start = data.qpos[robot.arm_positions].copy()
        # A servo that stops at full deceleration runs over a little; at the model's own limit it would hit a stop.
        self.ends_rad = (
            np.minimum(robot.lower_rad + _LIMIT_MARGIN_RAD, start),
            np.maximum(robot.upper_rad - _LIMIT_MARGIN_RAD, start),
        )
        """Where the joints (n,) end, lowest and highest"""
        limits = limits or MotionLimits()
        self._reference = JointReference(start, *self.ends_rad, limits, robot.drives.windup_rad(limits.windup_rad))
        self._joint_damping: FloatArray = model.dof_damping[robot.arm_velocities].copy()
        self._acceleration: FloatArray = np.zeros(model.nv)
        self._inertial: FloatArray = np.zeros(model.nv)
        mujoco.mj_forward(model, data)
        self._drive()

    @property
    def joint_count(self) -> int:
        """The number n of joints between the base and the tool."""
        return len(self._robot.arm_joints)

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `joint_velocity_rad_s` (n,) until `valid_until_s`, then decelerate from the measured state.

        Velocities are scaled as a whole to the arm's limit. ValueError for a wrong shape or a value that is not
        finite: nothing of it is applied.
        """
        self._reference.command(joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Close (+1), hold (0) or open (-1) at that share of the gripper's speed until `valid_until_s`.

        An arm without a gripper ignores it. ValueError for a value outside [-1, 1] or a time that is not finite.
        """
        if self._gripper is not None:
            self._gripper.command(closing, valid_until_s)

    def state(self, now_s: float) -> ArmState:
        """The measured state after the physics that `now_s` has made due; the first call sets the clocks together.

        At most 2 s are simulated at once: after a longer gap the rest is skipped, as if the world had paused.
        FeelaheadError when the simulation has become unstable.
        """
        if self._origin_s is None:
            self._origin_s = now_s
        # A little grace, so that a tick of the timestep's own period never misses its step by rounding.
        due = math.floor((now_s - self._time_s) / self._step_s + 1e-6)
        run = min(due, round(_LONGEST_ADVANCE_S / self._step_s))
        for _ in range(run):
            self._advance_one_step()
        if run > 0:
            self._origin_s += (due - run) * self._step_s
            self._require_stable()
        if run > 0 or self._state is None:
            self._state = self._measure()
        return self._state

    @property
    def _time_s(self) -> float:
        """The physics' present time on the caller's clock."""
        return (self._origin_s or 0.0) + self._steps * self._step_s

    def _advance_one_step(self) -> None:
        data, robot = self._data, self._robot
        self._reference.advance(
            self._time_s, self._step_s, data.qpos[robot.arm_positions], data.qvel[robot.arm_velocities]
        )
        if self._gripper is not None:
            actuator = robot.gripper_actuators[0]
            self._gripper.advance(
                self._time_s, self._step_s, data.actuator_length[actuator], data.actuator_velocity[actuator]
            )
        self._drive()
        mujoco.mj_step(self._model, data)
        self._steps += 1

    def _drive(self) -> None:
        """Turn the references into the actuators' inputs."""
        data, robot, reference = self._data, self._robot, self._reference
        dofs = robot.arm_velocities
        position = data.qpos[robot.arm_positions]
        self._acceleration[dofs] = reference.acceleration_rad_s2 + robot.drives.motor_acceleration(
            reference.position_rad - position, reference.velocity_rad_s - data.qvel[dofs]
        )
        mujoco.mj_mulM(self._model, data, self._inertial, self._acceleration)
        load = self._inertial[dofs] + data.qfrc_bias[dofs] - data.qfrc_gravcomp[dofs] - data.qfrc_spring[dofs]
        load += self._joint_damping * reference.velocity_rad_s
        data.ctrl[robot.arm_controls] = robot.drives.control(
            position, reference.position_rad, reference.velocity_rad_s, load
        )
        if self._gripper is not None:
            data.ctrl[robot.gripper_controls] = self._gripper.control

    def _measure(self) -> ArmState:
        data, robot = self._data, self._robot
        joints = self.joint_count
        readings = self._encoder.read(data.qpos[np.concatenate([robot.arm_positions, robot.finger_positions])])
        return ArmState(
            time_s=self._time_s,
            joint_positions_rad=readings[:joints],
            joint_velocities_rad_s=data.qvel[robot.arm_velocities].copy(),
            finger_positions=readings[joints:],
            gripper_opening_m=0.0 if self._gripper is None else self._gripper.opening_m,
            gripper_holding=self._gripper is not None and self._gripper.holding,
        )

    def _require_stable(self) -> None:
        # MuJoCo resets an unstable simulation to its start, which must not pass for a motion of the arm.
        if any(self._data.warning[kind].number for kind in _UNSTABLE):
            raise FeelaheadError(
                f"the simulation became unstable at {self._data.time:.3f} s; a smaller timestep in the model may help"
            )
