"""The simulated arm: physics on a clock of its own, commands that run out, and sensors."""

import math
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.clock import Clock
from common.errors import FeelaheadError
from robot_side.arm.port import ArmState
from robot_side.compiled.kernel import (
    NUMBER,
    TRUTH,
    compiled,
    input_array,
    input_indices,
    output_array,
    record_array,
)
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.gripper_drive import GRIPPER, GRIPPER_INPUT, GripperDrive, advance_gripper
from robot_side.simulation.gripper_measurement import measure_gripper
from robot_side.simulation.joint_drives import DRIVE, control, motor_acceleration
from robot_side.simulation.joint_reference import REFERENCE, JointReference, MotionLimits, advance_references
from robot_side.simulation.scene import Scene

_LONGEST_ADVANCE_S = 2.0
LONGEST_TURN_S: Final = 0.02
"""Physics that takes longer than real time gives way to messages, stops and leases this often."""
_LIMIT_MARGIN_RAD = 0.005
# Bad positions, velocities and accelerations, which are neighbours among MuJoCo's warnings.
_UNSTABLE = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)

_INERTIA: Final = np.dtype([("place", np.int64), ("row", np.int64), ("column", np.int64)])
"""One element of the arm's inertia matrix on or below its diagonal, by joints: its place in what MuJoCo keeps of it."""


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
        self._skipped = 0
        self._taken = 0, 0
        self._clock: Clock | None = None
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
        mujoco.mj_forward(model, data)
        # MuJoCo's arrays stay where they are as long as the state lives: asking for one costs more than a step's use.
        self._positions, self._velocities = data.qpos, data.qvel
        self._unstable = data.warning.number[_UNSTABLE]
        self._sensed = np.concatenate([robot.arm_positions, robot.finger_positions])
        gripper = self._gripper
        measured = int(robot.gripper_actuators[0]) if gripper is not None else 0
        self._tables = (
            self._reference.joints,
            robot.drives.table(model.dof_damping[robot.arm_velocities]),
            _inertia(model, robot.arm_velocities),
            np.zeros(0, GRIPPER) if gripper is None else gripper.drive,
            np.zeros((0, 3)) if gripper is None else gripper.samples,
            np.zeros(0, GRIPPER_INPUT) if gripper is None else gripper.inputs(robot.gripper_controls),
            robot.arm_positions,
            robot.arm_velocities,
            robot.arm_controls,
            data.qpos,
            data.qvel,
            data.M,
            data.qfrc_bias,
            data.qfrc_gravcomp,
            data.qfrc_spring,
            data.actuator_length[measured:],
            data.actuator_velocity[measured:],
            data.ctrl,
        )

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

    def give_way(self, clock: Clock) -> None:
        """From now on let no `state` last more than LONGEST_TURN_S, and a step, by `clock`, however much is due.

        What there was no time for is skipped: the simulation falls behind real time.
        """
        self._clock = clock

    def state(self, now_s: float) -> ArmState:
        """The measured state after the physics that `now_s` has made due; the first call sets the clocks together.

        At most 2 s are simulated at once: after a longer gap the rest is skipped, as if the world had paused.
        FeelaheadError when the simulation has become unstable, or MuJoCo gives up.
        """
        if self._origin_s is None:
            self._origin_s = now_s
        # A little grace, so that a tick of the timestep's own period never misses its step by rounding.
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
        """How much of the time since the first `state` has been simulated: 1 unless the physics is too slow."""
        return _share(self._steps, self._skipped)

    def take_share_of_real_time(self) -> float:
        """The same since this was last asked for."""
        (steps, skipped), self._taken = self._taken, (self._steps, self._skipped)
        return _share(self._steps - steps, self._skipped - skipped)

    @property
    def _time_s(self) -> float:
        """The physics' present time on the caller's clock."""
        return (self._origin_s or 0.0) + self._steps * self._step_s

    def _advance(self, due: int) -> int:
        """Simulate up to `due` steps, and at least one if any is due; how many there was time for."""
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
        time_s, limits = self._time_s, self._reference.limits
        _drive(
            *self._tables,
            *self._reference.follows(time_s),
            0.0 if self._gripper is None else self._gripper.moving(time_s),
            self._step_s,
            limits.velocity_rad_s,
            limits.acceleration_rad_s2,
            limits.deceleration_rad_s2,
        )
        mujoco.mj_step(self._model, self._data)
        self._steps += 1

    def _measure(self) -> ArmState:
        joints, gripper = self.joint_count, self._gripper
        readings = self._encoder.read(self._positions.take(self._sensed))
        return ArmState(
            time_s=self._time_s,
            joint_positions_rad=readings[:joints],
            joint_velocities_rad_s=self._velocities.take(self._robot.arm_velocities),
            finger_positions=readings[joints:],
            gripper_opening_m=0.0 if gripper is None else gripper.opening_m,
            gripper_holding=gripper is not None and gripper.holding,
        )

    def _require_stable(self) -> None:
        # MuJoCo resets an unstable simulation to its start, which must not pass for a motion of the arm.
        if self._unstable.any():
            raise FeelaheadError(
                f"the simulation became unstable at {self._data.time:.3f} s; a smaller timestep in the model may help"
            )


def _share(steps: int, skipped: int) -> float:
    return steps / (steps + skipped) if steps + skipped else 1.0


def _inertia(model: Any, velocities: IntArray) -> np.ndarray:
    """The elements (k,) of _INERTIA that joints at `velocities` (n,) among the degrees of freedom share."""
    joint_of = {int(velocity): joint for joint, velocity in enumerate(velocities)}
    found = [
        (place, joint, joint_of[int(model.M_colind[place])])
        for velocity, joint in joint_of.items()
        for place in range(model.M_rowadr[velocity], model.M_rowadr[velocity] + model.M_rownnz[velocity])
        if int(model.M_colind[place]) in joint_of
    ]
    return np.array(found, _INERTIA)


@compiled(
    *(record_array(REFERENCE), record_array(DRIVE), record_array(_INERTIA)),
    *(record_array(GRIPPER), input_array(2), record_array(GRIPPER_INPUT)),
    *(input_indices(), input_indices(), input_indices()),
    *(input_array(1), input_array(1), input_array(1), input_array(1), input_array(1), input_array(1)),
    *(input_array(1), input_array(1), output_array(1)),
    *(TRUTH, TRUTH, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER),
)
def _drive(
    joints: Any,
    drives: Any,
    inertia: Any,
    grippers: Any,
    samples: FloatArray,
    inputs: Any,
    positions: IntArray,
    velocities: IntArray,
    controls: IntArray,
    qpos: FloatArray,
    qvel: FloatArray,
    mass: FloatArray,
    bias: FloatArray,
    compensated: FloatArray,
    sprung: FloatArray,
    gripper_length: FloatArray,
    gripper_speed: FloatArray,
    ctrl: FloatArray,
    following: bool,
    ended: bool,
    closing: float,
    step_s: float,
    fastest: float,
    acceleration: float,
    deceleration: float,
) -> None:
    """Move the references on by `step_s` and turn them into the actuators' inputs `ctrl` (nu,).

    positions, velocities, controls (n,): the joints' places in qpos, qvel and ctrl. mass: MuJoCo's inertia matrix, of
    which `inertia` names the arm's elements. bias, compensated, sprung (nv,): the forces of gravity and velocity, what
    compensates gravity, and of springs. gripper_length, gripper_speed: of the gripper's first actuator, in front.
    """
    for j in range(joints.size):
        joints[j].measured_position, joints[j].measured_velocity = qpos[positions[j]], qvel[velocities[j]]
    advance_references(joints, following, ended, step_s, fastest, acceleration, deceleration)
    for j in range(joints.size):
        joint, drive, place = joints[j], drives[j], velocities[j]
        position_error = joint.position - joint.measured_position
        velocity_error = joint.velocity - joint.measured_velocity
        drive.acceleration = joint.acceleration + motor_acceleration(drive, position_error, velocity_error)
        drive.load = bias[place] - compensated[place] - sprung[place] + drive.friction * joint.velocity
    for k in range(inertia.size):
        row, column = inertia[k].row, inertia[k].column
        element = mass[inertia[k].place]
        drives[row].load += element * drives[column].acceleration
        if row != column:
            drives[column].load += element * drives[row].acceleration
    for j in range(joints.size):
        joint, drive = joints[j], drives[j]
        position_error = joint.position - joint.measured_position
        ctrl[controls[j]] = control(drive, position_error, joint.position, joint.velocity, drive.load)
    for g in range(grippers.size):
        advance_gripper(grippers[g], samples, closing, step_s, gripper_length[g], gripper_speed[g])
        for i in range(inputs.size):
            ctrl[inputs[i].place] = inputs[i].open + grippers[g].reference * (inputs[i].closed - inputs[i].open)
