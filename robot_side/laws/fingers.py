"""Velocities of the gripper's spheres relative to the tool, measured from recent positions: the fingers' motion."""

from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, scale, subtract
from robot_side.laws.memory import FINGER_POSES, memory_at

_NOISE_M_S: Final = 0.015
"""Speed up to which the fingers count as at rest, because their position readings are noisy"""
_FINGERS_S: Final = 0.06
"""Time over which the fingers' speed is measured"""


@inlined
def measure_fingers(
    bundle: IntArray, centers: FloatArray, tool: Vector, rotation: FloatArray, now: float, changed: bool
) -> None:
    """Measure the velocity of each sphere relative to the tool. centers (m, 3): the spheres' present centres.

    changed: whether the spheres have changed in number; then earlier positions are dropped and all velocities are 0.
    """
    memory = memory_at(bundle)
    state, count = memory.state[0], centers.shape[0]
    oldest = 0
    while oldest < state.finger_poses and memory.finger_poses_s[oldest] < now - _FINGERS_S - 1e-9:
        oldest += 1
    if state.finger_poses - oldest == FINGER_POSES:
        oldest += 1
    kept = 0 if changed else state.finger_poses - oldest
    for pose in range(kept if oldest > 0 else 0):
        memory.finger_poses_s[pose] = memory.finger_poses_s[pose + oldest]
        for i in range(count):
            for axis in range(3):
                memory.finger_poses_m[pose * count + i, axis] = memory.finger_poses_m[(pose + oldest) * count + i, axis]
    state.finger_poses, memory.finger_poses_s[kept] = kept + 1, now
    passed, fastest = now - memory.finger_poses_s[0], 0.0
    for i in range(count):
        lever = subtract(load(centers, i), tool)
        for axis in range(3):
            column = rotation[0, axis], rotation[1, axis], rotation[2, axis]
            memory.finger_poses_m[kept * count + i, axis] = dot(lever, column)
        moved = subtract(load(memory.finger_poses_m, kept * count + i), load(memory.finger_poses_m, i))
        for axis in range(3):
            speed = dot(load(rotation, axis), scale(1.0 / passed, moved)) if passed > 0.0 else 0.0
            memory.own_m_s[i, axis], fastest = speed, max(fastest, abs(speed))
    state.moves_fingers = 1 if fastest > _NOISE_M_S else 0
    if state.moves_fingers == 0:
        memory.own_m_s[:count] = 0.0
