"""The simulated arm: physics on a clock of its own, commands that run out, sensors, and forward kinematics."""

import copy
import math
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError, FeelaheadError
from robot_side.arm.port import ArmState, GripperPose
from robot_side.gripper.spheres import cover_boxes
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.gripper_drive import GripperDrive
from robot_side.simulation.gripper_travel import (
    GripperSample,
    GripperServo,
    GripperTravel,
    candidate_ends,
    jaw_pairs,
    jaw_stroke_m,
    travel_from_samples,
)
from robot_side.simulation.joint_reference import JointReference, MotionLimits
from robot_side.simulation.scene import Scene

_LONGEST_ADVANCE_S = 2.0
_LIMIT_MARGIN_RAD = 0.005
_GRIPPER_SAMPLES = 9
_SHORTEST_SETTLING_S, _LONGEST_SETTLING_S = 0.05, 2.0
_FARTHEST_GAP_M = 0.5
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
        lower = np.minimum(robot.lower_rad + _LIMIT_MARGIN_RAD, start)
        upper = np.maximum(robot.upper_rad - _LIMIT_MARGIN_RAD, start)
        self._reference = JointReference(start, lower, upper, limits or MotionLimits())
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


class MujocoKinematics:
    """GripperKinematics: the gripper where the encoders say it is, in a copy of the state that nobody simulates."""

    def __init__(self, scene: Scene, sphere_count: int = 16) -> None:
        """Cover the gripper's geoms with `sphere_count` spheres, or one for each geom where there are more.

        ConfigurationError when the robot has nothing at the tool that could touch anything.
        """
        self._model, self._robot = scene.model, scene.robot
        model, geoms = scene.model, scene.robot.gripper_geoms
        if geoms.size == 0:
            raise ConfigurationError("model: nothing at the tool can touch anything; valid: 1 or more colliding geoms")
        self._data = mujoco.MjData(model)
        self._data.qpos[:] = scene.data.qpos
        rotations = np.array([_rotation(model.geom_quat[geom]) for geom in geoms])
        # The gripper is covered in the frames of its links, in which its geoms do not move.
        centers = model.geom_pos[geoms] + np.einsum("kij,kj->ki", rotations, model.geom_aabb[geoms, :3])
        cover = cover_boxes(centers, rotations, model.geom_aabb[geoms, 3:], sphere_count)
        self._bodies: IntArray = model.geom_bodyid[geoms][cover.box].astype(np.int64)
        self._local_centers_m = cover.centers_m[:, :, None]
        self._radii_m = cover.radii_m
        self._on_finger = scene.robot.geom_on_finger[cover.box]
        # Every pose shares these two.
        self._radii_m.setflags(write=False)
        self._on_finger.setflags(write=False)
        self._jacobian: FloatArray = np.zeros((6, model.nv))
        self._cross: FloatArray = np.zeros((len(cover.radii_m), 3, 3))

    def pose(self, state: ArmState) -> GripperPose:
        """The gripper at the encoder readings of `state` (eq. 4); the fingers' own motion is not in its Jacobians."""
        model, data, robot = self._model, self._data, self._robot
        data.qpos[robot.arm_positions] = state.joint_positions_rad
        data.qpos[robot.finger_positions] = state.finger_positions
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, self._jacobian[:3], self._jacobian[3:], robot.site)
        jacobian = self._jacobian.take(robot.arm_velocities, axis=1)
        tool = data.site_xpos[robot.site].copy()
        body_rotations = data.xmat[self._bodies].reshape(-1, 3, 3)
        centers = data.xpos[self._bodies] + (body_rotations @ self._local_centers_m)[:, :, 0]
        # v_i = v + ω × r_i, written as a product with the matrix that takes ω to -r_i × ω.
        x, y, z = (centers - tool).T
        cross = self._cross
        cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = z, -y, x
        cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = -z, y, -x
        return GripperPose(
            tool_position_m=tool,
            tool_rotation=data.site_xmat[robot.site].reshape(3, 3).copy(),
            tool_jacobian=jacobian,
            sphere_centers_m=centers,
            sphere_radii_m=self._radii_m,
            sphere_jacobians=jacobian[:3] + cross @ jacobian[3:],
            sphere_on_finger=self._on_finger,
        )


def measure_gripper(scene: Scene) -> GripperTravel | None:
    """How the gripper of `scene` opens and closes, found by driving a copy of it to both ends in empty space.

    None without a gripper, or with one whose fingers' geoms do not come nearer to each other.
    ConfigurationError for a gripper actuator whose range of inputs is not known.
    """
    robot, actuators = scene.robot, scene.robot.gripper_actuators
    if actuators.size == 0:
        return None
    model = copy.copy(scene.model)
    unknown = actuators[~model.actuator_ctrllimited[actuators].astype(bool)]
    if unknown.size:
        raise ConfigurationError(
            f"model: the gripper's actuator {model.actuator(int(unknown[0])).name!r} has no ctrlrange; valid: its open"
            " and its closed input"
        )
    # The copy hangs in empty space, and its arm is left limp and put back after every step.
    model.opt.gravity[:] = 0.0
    elsewhere = model.body_rootid[model.geom_bodyid] != robot.root_body
    model.geom_contype[elsewhere] = model.geom_conaffinity[elsewhere] = 0
    idle = np.setdiff1d(np.arange(model.nu), actuators)
    model.actuator_gainprm[idle] = model.actuator_biasprm[idle] = 0.0
    ranges = model.actuator_ctrlrange[actuators]
    sweeps = [_sweep_gripper(model, scene, *ends) for ends in candidate_ends(ranges[:, 0], ranges[:, 1])]
    servo = GripperServo(
        gain=model.actuator_gainprm[actuators, 0],
        stiffness=-model.actuator_biasprm[actuators, 1],
        damping=-model.actuator_biasprm[actuators, 2],
        force_limit=np.where(
            model.actuator_forcelimited[actuators], np.abs(model.actuator_forcerange[actuators]).min(axis=1), np.inf
        ),
    )
    return travel_from_samples(max(sweeps, key=jaw_stroke_m), servo)


def _sweep_gripper(model: Any, scene: Scene, first: FloatArray, last: FloatArray) -> list[GripperSample]:
    robot, data = scene.robot, mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    held = scene.data.qpos[robot.arm_positions].copy()
    pairs = jaw_pairs(robot.gripper_geoms, model.geom_bodyid[robot.gripper_geoms], robot.geom_on_finger)
    samples = []
    for share in np.linspace(0.0, 1.0, _GRIPPER_SAMPLES):
        control = first + share * (last - first)
        data.ctrl[robot.gripper_controls] = control
        for step in range(round(_LONGEST_SETTLING_S / model.opt.timestep)):
            mujoco.mj_step(model, data)
            data.qpos[robot.arm_positions] = held
            data.qvel[robot.arm_velocities] = 0.0
            resting = np.abs(data.qvel[robot.finger_velocities]).max(initial=0.0) < 1e-3
            if resting and step * model.opt.timestep > _SHORTEST_SETTLING_S:
                break
        mujoco.mj_forward(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, *pair, _FARTHEST_GAP_M, None) for pair in pairs]
        samples.append(
            GripperSample(
                control=control,
                fingers=data.qpos[robot.finger_positions].copy(),
                length=float(data.actuator_length[robot.gripper_actuators[0]]),
                gaps_m=np.array(gaps),
            )
        )
    return samples


def _rotation(quaternion: FloatArray) -> FloatArray:
    matrix: FloatArray = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
