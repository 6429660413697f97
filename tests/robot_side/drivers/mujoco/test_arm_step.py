"""The simulated arm's compiled step, compared with plain NumPy and MuJoCo's own products in long random runs."""

from collections.abc import Callable
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, measure_gripper
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import MIRRORED_GRIPPER, MOTORS, POSITION_SERVOS, SEVERAL, VELOCITY_SERVOS, planar_arm

WINDUP_RAD = 0.01
# Each joint has limits of its own; those with a limited jerk have a test of theirs.
UNEQUAL = JointLimits(
    np.array([1.0, 0.8, 1.2, 1.0, 0.9, 1.1]),
    np.array([8.0, 6.0, 9.0, 8.0, 7.0, 5.0]),
    deceleration_rad_s2=np.array([12.0, 11.0, 12.0, 14.0, 12.0, 10.0]),
    jerk_rad_s3=np.full(6, np.inf),
)
STEPS = 3000
SPRING = '<joint name="elbow" stiffness="3" springref="-40"'


class PlainReference:
    def __init__(
        self, position: FloatArray, ends: tuple[FloatArray, FloatArray], windup: FloatArray, yields: FloatArray
    ) -> None:
        self.position, (self.lower, self.upper), self.windup, self.yields = position, ends, windup, yields
        self.limits = first_of(UNEQUAL, len(position))
        self.velocity, self.acceleration, self.command = (np.zeros_like(position) for _ in range(3))
        self.followed = False

    def told(self, velocity: FloatArray) -> None:
        self.command = velocity / max((np.abs(velocity) / self.limits.velocity_rad_s).max(), 1.0)

    def advance(self, following: bool, step_s: float, measured: FloatArray, measured_speed: FloatArray) -> None:
        if self.followed and not following:
            self.position = measured
            self.velocity = np.clip(measured_speed, -self.limits.velocity_rad_s, self.limits.velocity_rad_s)
        self.followed = following
        stopping = 2.0 * self.limits.deceleration_rad_s2
        slowest = -np.sqrt(stopping * np.maximum(self.position - self.lower, 0.0))
        fastest = np.sqrt(stopping * np.maximum(self.upper - self.position, 0.0))
        change = (np.clip(self.command, slowest, fastest) if following else 0.0) - self.velocity
        most = (self.limits.acceleration_rad_s2 if following else self.limits.deceleration_rad_s2) * step_s
        change = change * min((most / np.maximum(np.abs(change), 1e-300)).min(), 1.0)
        velocity = np.clip(self.velocity + change, slowest, fastest)
        self.acceleration, self.velocity = (velocity - self.velocity) / step_s, velocity
        lead = self.windup + np.abs(velocity * step_s)
        near = np.clip(
            np.clip(self.position + velocity * step_s, self.lower, self.upper),
            np.minimum(self.position, measured - lead),
            np.maximum(self.position, measured + lead),
        )
        farthest = np.maximum(self.yields, lead)
        self.position = np.clip(near, measured - farthest, measured + farthest)


def first_of(limits: JointLimits, count: int) -> JointLimits:
    names = ("velocity_rad_s", "acceleration_rad_s2", "deceleration_rad_s2", "jerk_rad_s3")
    return JointLimits(**{name: getattr(limits, name)[:count] for name in names})


class PlainGripper:
    def __init__(self, travel: GripperTravel) -> None:
        self.travel = travel
        self.reference = self.speed = self.standing_s = self.opening_m = 0.0
        self.closed_last = False

    def advance(self, moving: float, step_s: float, lengths: FloatArray, length_speeds: FloatArray) -> None:
        travel = self.travel
        closure = float((lengths - travel.open_lengths) @ travel.per_length)
        self.speed += (float(length_speeds @ travel.per_length) - self.speed) * min(step_s / 0.05, 1.0)
        self.opening_m = float(np.interp(closure, travel.closures, travel.openings_m))
        free = float(np.interp(closure, travel.closures, travel.references))
        if moving:
            self.closed_last = moving > 0.0
            lags = np.maximum(np.sign(moving) * self.speed, 0.0) * np.array(travel.lags_s)
            lead = min(lags[1] + 0.3, lags[0] + (travel.force_lead if moving > 0.0 else travel.opening_force_lead))
            nearest, farthest = sorted([free, free + np.sign(moving) * lead])
            moved = np.clip(self.reference + moving * step_s / 0.6, nearest, farthest)
            self.reference = float(np.clip(moved, *travel.ends))
        resists = np.interp(closure, travel.closures, travel.resists)
        resisted = self.reference - free - travel.lags_s[1] * self.speed > resists
        stands = abs(self.speed) < 0.05 or (self.standing_s >= 0.05 and self.speed * 0.6 < 0.5)
        self.standing_s = self.standing_s + step_s if resisted and stands and self.closed_last else 0.0

    @property
    def control(self) -> FloatArray:
        opened, closed = self.travel.open_control, self.travel.closed_control
        return opened + self.reference * (closed - opened)


def plain_inputs(scene: Scene, reference: PlainReference) -> tuple[FloatArray, FloatArray]:
    """Return the expected inputs (n,), empty if a joint has several, and torques (n,), computed in plain NumPy."""
    data, robot, drives = scene.data, scene.robot, scene.robot.drives
    stiffness, damping = (
        np.bincount(drives.joint, drives.gear**2 * values) for values in (drives.stiffness, drives.damping)
    )
    dofs, motor = robot.arm_velocities, (stiffness == 0.0) & (damping == 0.0)
    error = reference.position - data.qpos[robot.arm_positions]
    speed_error = reference.velocity - data.qvel[dofs]
    acceleration: FloatArray = np.zeros(scene.model.nv)
    acceleration[dofs] = reference.acceleration + np.where(motor, 2500.0 * error + 100.0 * speed_error, 0.0)
    inertial: FloatArray = np.zeros(scene.model.nv)
    mujoco.mj_mulM(scene.model, data, inertial, acceleration)
    load = (inertial + data.qfrc_bias - data.qfrc_gravcomp - data.qfrc_spring)[dofs]
    load = load + scene.model.dof_damping[dofs] * reference.velocity
    ahead = np.where((stiffness == 0.0) & ~motor, 20.0 * error, 0.0)
    # On its reference a joint feels the load's torque and nothing else.
    torque = load + stiffness * error + damping * (speed_error + ahead)
    if len(drives.gear) > len(dofs):
        return np.empty(0), torque
    length = drives.gear * data.qpos[robot.arm_positions]
    length_speed = drives.gear * data.qvel[dofs]
    held_back = drives.offset - drives.stiffness * length - drives.damping * length_speed
    return (torque / drives.gear - held_back) / drives.gain, torque


def built_in(_: Path) -> Scene:
    return load_scene()


def position_servos(path: Path) -> Scene:
    return load_scene(planar_arm(path, arm_actuators=POSITION_SERVOS), "tcp")


def velocity_servos(path: Path) -> Scene:
    return load_scene(planar_arm(path, arm_actuators=VELOCITY_SERVOS, gripper_actuators=""), "tcp")


def sprung_motors_and_two_fingers(path: Path) -> Scene:
    model = planar_arm(path, arm_actuators=MOTORS, gripper_actuators=MIRRORED_GRIPPER, extra_bottom="", mirrored=True)
    model.write_text(model.read_text().replace('<joint name="elbow"', SPRING))
    return load_scene(model, "tcp")


def four_on_a_joint(path: Path) -> Scene:
    return load_scene(planar_arm(path, arm_actuators=SEVERAL[0] + SEVERAL[3]), "tcp")


@pytest.mark.parametrize(
    "load", [built_in, position_servos, velocity_servos, sprung_motors_and_two_fingers, four_on_a_joint]
)
def test_every_step_is_what_plain_formulas_say(tmp_path: Path, load: Callable[[Path], Scene]) -> None:
    scene = load(tmp_path)
    data, robot = scene.data, scene.robot
    travel = measure_gripper(scene)
    limits = first_of(UNEQUAL, len(scene.robot.arm_joints))
    arm = MujocoArm(scene, Encoder(0.0, 0.0), limits, windup_rad=WINDUP_RAD)
    step_s, joints = scene.model.opt.timestep, arm.joint_count
    gripper = None if travel is None else PlainGripper(travel)
    start = data.qpos[robot.arm_positions]
    windup_rad = robot.drives.windup_rad(WINDUP_RAD)
    reference = PlainReference(start, arm.ends_rad, windup_rad, robot.drives.yield_rad())
    random = np.random.default_rng(1)
    arm.state(0.0)
    ends_s, closing_ends_s, closing, followed, ran_out = -1.0, -1.0, 0.0, 0, 0
    for step in range(STEPS):
        now_s = step * step_s
        if random.uniform() < 0.02:
            ends_s = now_s + random.uniform(0.0, 0.2)
            velocity = random.uniform(-1.5, 1.5, joints)
            arm.command(velocity, ends_s)
            reference.told(velocity)
        if random.uniform() < 0.02:
            closing, closing_ends_s = (
                float(random.choice([-1.0, -0.3, 0.0, 0.5, 1.0])),
                now_s + random.uniform(0.0, 0.3),
            )
            arm.command_gripper(closing, closing_ends_s)
        followed, ran_out = followed + (now_s < ends_s), ran_out + (now_s >= ends_s)
        before, was_there = reference.velocity, data.qpos[robot.arm_positions].copy()
        reference.advance(now_s < ends_s, step_s, was_there, data.qvel[robot.arm_velocities])
        # No limit is broken, and the only jump is to the measurement when a command ends.
        assert (np.abs(reference.velocity) <= limits.velocity_rad_s + 1e-12).all()
        assert (np.abs(reference.position - was_there) <= windup_rad + np.abs(reference.velocity * step_s) + 1e-9).all()
        assert ((arm.ends_rad[0] <= reference.position) & (reference.position <= arm.ends_rad[1])).all()
        if now_s < ends_s:
            assert (np.abs(reference.velocity - before) <= limits.deceleration_rad_s2 * step_s + 1e-12).all()
        control, torque = plain_inputs(scene, reference)
        if gripper is not None:
            of = robot.gripper_actuators
            lengths, speeds = data.actuator_length[of].copy(), data.actuator_velocity[of].copy()
            gripper.advance(closing if now_s < closing_ends_s else 0.0, step_s, lengths, speeds)
        state = arm.state(now_s + step_s)
        if len(control):
            np.testing.assert_allclose(data.ctrl[robot.drives.place], control, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(state.joint_positions_rad, data.qpos[robot.arm_positions])
        np.testing.assert_array_equal(state.joint_velocities_rad_s, data.qvel[robot.arm_velocities])
        strong = np.abs(torque) < np.bincount(robot.drives.joint, robot.drives.strongest)
        given = data.qfrc_actuator[robot.arm_velocities]
        np.testing.assert_allclose(given[strong], torque[strong], rtol=1e-9, atol=1e-9)
        if gripper is not None:
            np.testing.assert_allclose(data.ctrl[robot.gripper_controls], gripper.control, rtol=1e-12, atol=1e-12)
            assert state.gripper_opening_m == pytest.approx(gripper.opening_m, abs=1e-12)
            assert state.gripper_holding == (
                gripper.standing_s >= 0.05 and gripper.opening_m - gripper.travel.openings_m[-1] > 1e-3
            )
    assert min(followed, ran_out) > STEPS // 5


def test_a_measurement_is_not_changed_by_the_next() -> None:
    arm = MujocoArm(load_scene(), Encoder(seed=1))
    arm.state(0.0)
    arm.command(np.full(6, 0.3), 1.0)
    first = arm.state(0.1)
    kept = [first.joint_positions_rad.copy(), first.joint_velocities_rad_s.copy(), first.finger_positions.copy()]
    arm.state(0.2)
    for now, before in zip(
        (first.joint_positions_rad, first.joint_velocities_rad_s, first.finger_positions), kept, strict=True
    ):
        np.testing.assert_array_equal(now, before)
