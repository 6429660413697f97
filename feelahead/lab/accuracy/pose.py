"""The gripper's pose: our forward kinematics beside MuJoCo's, and what averaging the encoders does to its error."""

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from common.arrays import FloatArray
from common.periods import PERIODS_S, TURN_S, period_text
from feelahead.lab.accuracy.points import Part, point
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.interleaved import processor_us
from feelahead.lab.table import Row
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.arm.port import ArmState, GripperPose
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.settings import EncoderSettings

UNIT: Final = "mm of pose"
EXACT: Final = Part("pose, exact readings", UNIT, "each other")
NOISY: Final = Part("pose, noise, 4 ms of turns", UNIT, "true joints")
TURNS_S: Final = (PERIODS_S[0], TURN_S, 0.010)
_SPEED_RAD_S: Final = 0.3
_SETTLING_S: Final = 0.2


def measure(count: int, seconds: float, rounds: int, random: np.random.Generator) -> Iterator[Row]:
    """Measure both at `count` random configurations, and the encoders' noise over `seconds` of motion."""
    scene = load_scene(frozen_scene("wall"), SITE)
    kinematics = MujocoKinematics(scene)
    states = [_state(scene, 0.0, joints) for joints in random.uniform(-2.0, 2.0, (count, _joints(scene)))]
    works: dict[str, Callable[[], object]] = {
        "ours": partial(kinematics.pose, states[0]),
        "links alone": partial(scene.show, states[0]),
        "links, NumPy's spheres": partial(centers_by_mujoco_m, scene, kinematics, states[0]),
    }
    encoder = EncoderSettings()
    moved = {period_s: _moving(scene, period_s, seconds, encoder, random) for period_s in TURNS_S}
    estimates = {period_text(period_s): _averaging(kinematics, readings) for period_s, (_, readings) in moved.items()}
    times_us = processor_us(works | estimates, rounds)
    errors_mm = np.array([pose_error_mm(scene, kinematics, state) for state in states])
    # Which of both is right is not known: what they differ by counts as the error of each.
    name, *others = works
    yield point(EXACT, "forward kinematics", "spheres and Jacobian", times_us[name], errors_mm, built=True)
    for other in others:
        yield point(EXACT, "MuJoCo", other, times_us[other], errors_mm, ours=False)
    for period_s, (true, readings) in moved.items():
        text = period_text(period_s)
        if period_s == TURN_S:
            single_mm = [apart_mm(kinematics.pose(a), kinematics.pose(b)) for a, b in zip(readings, true, strict=True)]
            yield point(NOISY, "averaging", "none", times_us["ours"], _settled(single_mm, period_s))
        estimate = JointEstimate()
        found = [kinematics.pose(estimate.update(reading)) for reading in readings]
        averaged_mm = [apart_mm(one, kinematics.pose(state)) for one, state in zip(found, true, strict=True)]
        us, built = times_us[text] * TURN_S / period_s, period_s == TURN_S
        yield point(NOISY, "averaging", f"turns of {text}", us, _settled(averaged_mm, period_s), built=built)


def centers_by_mujoco_m(scene: Scene, kinematics: MujocoKinematics, state: ArmState) -> FloatArray:
    """Return the spheres' centres (m, 3) by MuJoCo's poses of the links, in the cover's order."""
    scene.show(state)
    cover, data = kinematics.cover, scene.data
    turns = data.xmat[cover.bodies].reshape(-1, 3, 3)
    centers_m: FloatArray = data.xpos[cover.bodies] + np.einsum("mij,mj->mi", turns, cover.centers_m)
    return centers_m


def pose_error_mm(scene: Scene, kinematics: MujocoKinematics, state: ArmState) -> float:
    """Return the largest distance in mm of our spheres' centres, which have another order, from MuJoCo's."""
    nearest = cKDTree(centers_by_mujoco_m(scene, kinematics, state))
    return 1e3 * float(np.max(nearest.query(kinematics.pose(state).sphere_centers_m)[0]))


def apart_mm(one: GripperPose, other: GripperPose) -> float:
    """Return the largest distance in mm between the same spheres of two poses."""
    return 1e3 * float(np.linalg.norm(one.sphere_centers_m - other.sphere_centers_m, axis=1).max())


def _joints(scene: Scene) -> int:
    return len(scene.robot.arm_positions)


def _state(scene: Scene, time_s: float, joints_rad: FloatArray, rates_rad_s: FloatArray | None = None) -> ArmState:
    rates = np.zeros_like(joints_rad) if rates_rad_s is None else rates_rad_s
    return ArmState(time_s, joints_rad, rates, scene.data.qpos[scene.robot.finger_positions], 0.0, False)


def _moving(
    scene: Scene, period_s: float, seconds: float, encoder: EncoderSettings, random: np.random.Generator
) -> tuple[list[ArmState], list[ArmState]]:
    """Return true states and readings, one a turn, while each joint swings with up to 0.3 rad/s."""
    times_s = np.arange(0.0, seconds, period_s)
    home = scene.data.qpos[scene.robot.arm_positions]
    phases, rates = random.uniform(0.0, 2.0 * np.pi, home.size), random.uniform(1.0, 4.0, home.size)
    device = Encoder(encoder.sigma_rad, encoder.resolution_rad, int(random.integers(1 << 30)))
    true, readings = [], []
    for time_s in times_s.tolist():
        joints = home + _SPEED_RAD_S / rates * np.sin(rates * time_s + phases)
        speeds = _SPEED_RAD_S * np.cos(rates * time_s + phases)
        true.append(_state(scene, time_s, joints, speeds))
        readings.append(_state(scene, time_s, device.read(joints), speeds))
    return true, readings


def _averaging(kinematics: MujocoKinematics, readings: list[ArmState]) -> Callable[[], None]:
    """Return a function that takes the next reading into an estimate and places the gripper by it."""
    turns, estimate = itertools.cycle(readings), JointEstimate()

    def turn() -> None:
        kinematics.pose(estimate.update(next(turns)))

    return turn


def _settled(errors_mm: list[float], period_s: float) -> FloatArray:
    return np.array(errors_mm[round(_SETTLING_S / period_s) :])
