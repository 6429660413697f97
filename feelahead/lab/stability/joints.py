"""Joints under stress: forward kinematics after many turns, resolved rate at singular poses, chattering encoders."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.stability.tally import Part, Tally
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.arm.port import ArmState
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import load_scene

Rng = np.random.Generator
_TURNS: Final = (0.0, 1.0, 1e3, 1e6, 1e9)
_DAMPING: Final = 0.06
"""Largest damping and threshold of the damped least squares, σ_0 = λ_max"""


def check_kinematics(group: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Compare the built-in arm's forward kinematics with MuJoCo's, and its tool's rotation with an orthonormal one."""
    scene = load_scene()
    ours, theirs = PosedGripper(scene), PosedScene(scene)
    for turns in _TURNS:
        case = f"{group}, {turns:g} turns" if turns else f"{group}, within a turn"
        tool, turned = Tally(case, "m, from MuJoCo", 1e-12), Tally(case, "of RᵀR, from I", 1e-13)
        for number in range(count):
            where = f"number {number}"
            with tool.tried(where):
                angles = rng.uniform(-math.pi, math.pi, len(ours.home_rad))
                angles += 2.0 * math.pi * turns * rng.choice((-1.0, 1.0), len(angles))
                theirs.set_pose(angles, ours.fingers, np.zeros(3))
                pose, (position_m, _) = ours.at(angles), theirs.tool_pose()
                tool.note(pose.tool_position_m - position_m, where)
                turned.note(pose.tool_rotation.T @ pose.tool_rotation - np.eye(3), where)
        yield from (tool, turned)


def jacobians(rng: Rng) -> dict[str, FloatArray]:
    """Return Jacobians (6, n) of each class, most of them at or near a singularity, by the class's name."""
    arm = PosedGripper(load_scene())
    found = {}
    for name, angles in (("arm, stretched", 0.0 * arm.home_rad), ("arm, folded", math.pi * np.sign(arm.home_rad))):
        found[name] = arm.at(angles).tool_jacobian
    stretched = arm.home_rad.copy()
    for joint in range(len(stretched)):
        stretched[joint] = 0.0
        found[f"arm, joint {joint + 1} and all before at 0"] = arm.at(stretched).tool_jacobian
    for joints in (1, 3, 6, 7, 12):
        left = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        right = np.linalg.qr(rng.normal(size=(joints, joints)))[0]
        size = min(6, joints)
        for least in (0.0, 1e-300, 1e-15, 1e-9, 1e-4, math.nextafter(_DAMPING, 0.0), _DAMPING, 0.0600001):
            for zeros in (1, size):
                values = rng.uniform(0.1, 2.0, size)
                values[-zeros:] = least
                name = f"{joints} joints, {'all' if zeros == size else 'one'} of σ {least:g}"
                found[name] = left[:, :size] @ np.diag(values) @ right[:size]
        found[f"{joints} joints, σ to 100"] = left[:, :size] @ np.diag(np.geomspace(1e-9, 1e2, size)) @ right[:size]
    return found


def check_resolved_rate(group: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Compare joint velocities with damped least squares by NumPy's singular values, and with two bounds."""
    tallies = [
        Tally(f"{group}, damped", "of the greatest speed |v| / σ_0, from NumPy", 1e-9),
        Tally(f"{group}, speed", "of |v| / σ_0, the greatest speed", 1.0 + 1e-9),
        Tally(f"{group}, joints' limits", "of the joint's limit", 1.0 + 1e-12),
    ]
    damped, bounded, limited = tallies
    for name, jacobian in jacobians(rng).items():
        joints = jacobian.shape[1]
        for size in (1e-100, 1e-9, 0.2, 1e3, 1e100):
            for number in range(count):
                where, twist = f"{name}, twist {size:g}, number {number}", size * rng.normal(size=6)
                limits = np.full(joints, 2.0)
                with damped.tried(where):
                    free = joint_velocities(jacobian, twist, np.full(joints, math.inf))
                    greatest = float(np.linalg.norm(twist)) / _DAMPING
                    damped.note((free - _damped(jacobian, twist)) / greatest, where)
                    bounded.note(np.linalg.norm(free / greatest), where)
                    limited.note(joint_velocities(jacobian, twist, limits) / limits, where)
    yield from tallies


def _damped(jacobian: FloatArray, twist: FloatArray) -> FloatArray:
    left, values, right = np.linalg.svd(jacobian, full_matrices=False)
    damping_2 = _DAMPING**2 - min(float(values[-1]), _DAMPING) ** 2
    shares = np.divide(values, values**2 + damping_2, out=np.zeros_like(values), where=values > 0.0)
    velocities: FloatArray = right.T @ (shares * (left.T @ twist))
    return velocities


_AMPLITUDES: Final = {
    "a digit": 1e-6,
    "noise": 1e-3,
    "below a restart": 4.9e-3,
    "beyond a restart": 0.02,
    "a turn": 6.3,
}


def check_estimate(_: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Let encoders chatter about a true motion, and compare the estimate's error with the chatter's amplitude."""
    for name, amplitude in _AMPLITUDES.items():
        joints = Tally(f"chatter, {name}: joints", "of the chatter's amplitude", 1.0 + 1e-6)
        fingers = Tally(f"chatter, {name}: fingers", "of the chatter's amplitude", 1.5)
        for number in range(count):
            for period_s in (1e-9, 1e-3, 0.004, 0.02, 0.099, 0.0):  # 0: another one each time
                where = f"number {number}, {period_s:g} s"
                with joints.tried(where):
                    _chatter(amplitude, period_s, rng, joints, fingers, where)
        yield from (joints, fingers)


def _chatter(amplitude: float, period_s: float, rng: Rng, joints: Tally, fingers: Tally, where: str) -> None:
    estimate, now_s, worst = JointEstimate(), 0.0, np.zeros(2)
    place, speed = rng.uniform(-3.0, 3.0, 6), rng.uniform(-1.0, 1.0, 6)
    every = int(rng.integers(1, 6))
    for turn in range(300):
        now_s += period_s or float(10.0 ** rng.uniform(-9.0, -1.01))
        true = place + speed * now_s
        off = amplitude * (1.0 if turn // every % 2 else -1.0)
        state = ArmState(now_s, true + off, speed, np.full(2, 0.02 + off), 0.04, gripper_holding=False)
        found = estimate.update(state)
        apart = found.joint_positions_rad - true, found.finger_positions - 0.02
        worst = np.fmax(worst, [np.abs(one).max() for one in apart])
        if not all(np.isfinite(one).all() for one in (*apart, estimate.carried(0.1).finger_positions)):
            worst[:] = np.nan
            break
    joints.note(worst[0] / amplitude, where)
    fingers.note(worst[1] / amplitude, where)


KINEMATICS: Final = Part(("built-in arm",), (200, 20), check_kinematics)
RESOLVED_RATE: Final = Part(("singular poses",), (4, 1), check_resolved_rate)
ESTIMATE: Final = Part(("encoders that chatter",), (10, 2), check_estimate)
