"""What moves the gripper besides a trigger: drift across, turning, and the fingers' own way. Where will it be by then?

What lies ahead of where the gripper is may not lie ahead of where it will be: the field is looked at from there, too.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.compiled.kernel import NUMBER, compiled, inlined, input_array, output_array
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract, unit

SPACING_M: Final = 0.015
"""No sphere gets farther between two places that are looked from, less than an inflated fingertip's sphere is wide. Of
who gets beyond the most places times this, places are farther apart."""
_LEAST_M: Final = 0.003
"""Who gets no farther than this is looked at where it is."""
MOST_PLACES: Final = 8
_NOISE_M_S: Final = 0.015
"""Slower than this, fingers rest: their readings are noisy."""
_FINGERS_S: Final = 0.06
"""Over so long their speed is measured."""


@dataclass(frozen=True)
class Sideways:
    """The gripper's velocity without that along the tool's approach axis, in the world frame."""

    linear_m_s: FloatArray
    """(3,) of the tool"""
    angular_rad_s: FloatArray
    """(3,)"""
    own_m_s: FloatArray
    """(m, 3) of each sphere against the tool: the fingers'"""

    @property
    def moves_fingers(self) -> bool:
        """Whether the fingers move against the tool."""
        return bool(self.own_m_s.any())

    def farthest_m(self, pose: GripperPose, after_s: float, ahead_m: float) -> float:
        """How far the sphere that gets farthest has gone by then, or one that is `ahead_m` farther on."""
        farther_m = ahead_m * pose.tool_rotation[:, 2]
        return after_s * float(
            _fastest(
                *(np.ascontiguousarray(pose.sphere_centers_m), pose.tool_position_m, farther_m),
                *(self.linear_m_s, self.angular_rad_s, self.own_m_s),
            )
        )

    def moments(self, pose: GripperPose, until_s: float, ahead_m: float = 0.0) -> tuple[float, ...]:
        """When to look from where the gripper will be, evenly in time, the last at `until_s`; none where it stays.

        ahead_m: so far ahead it is to be looked as finely as near the gripper, which counts while it turns.
        None for what is not finite, either: whoever looks refuses that.
        """
        farthest_m = self.farthest_m(pose, until_s, ahead_m)
        moves = farthest_m >= _LEAST_M and math.isfinite(farthest_m)
        count = min(math.ceil(farthest_m / SPACING_M), MOST_PLACES) if moves else 0
        return tuple(until_s * (number + 1) / count for number in range(count))

    def moved(self, pose: GripperPose, after_s: float) -> GripperPose:
        """The gripper as it will stand then, had the trigger not moved it."""
        tool_m, rotation, centers_m = np.empty(3), np.empty((3, 3)), np.empty((len(pose.sphere_radii_m), 3))
        _move(
            *(pose.tool_position_m, np.ascontiguousarray(pose.tool_rotation)),
            *(np.ascontiguousarray(pose.sphere_centers_m), self.linear_m_s, self.angular_rad_s, self.own_m_s, after_s),
            *(tool_m, rotation, centers_m),
        )
        return GripperPose(
            tool_position_m=tool_m,
            tool_rotation=rotation,
            tool_jacobian=pose.tool_jacobian,
            sphere_centers_m=centers_m,
            sphere_radii_m=pose.sphere_radii_m,
            sphere_on_finger=pose.sphere_on_finger,
        )


@compiled(
    *(input_array(2), input_array(1), input_array(1), input_array(1), input_array(1), input_array(2)),
    returns=NUMBER,
)
def _fastest(
    centers: FloatArray,
    tool: FloatArray,
    farther: FloatArray,
    linear: FloatArray,
    angular: FloatArray,
    own: FloatArray,
) -> float:
    """|v + ω × r + its own| of the fastest sphere, or of one farther on by `farther` (3,); NaN for what is none."""
    velocity, turning = load(linear.reshape(1, 3), 0), load(angular.reshape(1, 3), 0)
    origin, ahead = load(tool.reshape(1, 3), 0), load(farther.reshape(1, 3), 0)
    fastest, check = 0.0, 0.0
    for i in range(centers.shape[0]):
        lever, alone = subtract(load(centers, i), origin), add(velocity, load(own, i))
        near, far = norm(add(alone, cross(turning, lever))), norm(add(alone, cross(turning, add(lever, ahead))))
        fastest = max(fastest, near, far)
        # A maximum may hide what is no number.
        check += near + far
    return fastest if math.isfinite(check) else math.nan


@inlined
def _turned(vector: Vector, axis: Vector, sine: float, versine: float) -> Vector:
    """By an angle about a unit vector (Rodrigues): v + sin · a × v + (1 - cos) · a × (a × v)."""
    across = cross(axis, vector)
    return add(vector, add(scale(sine, across), scale(versine, cross(axis, across))))


@compiled(
    *(input_array(1), input_array(2), input_array(2), input_array(1), input_array(1), input_array(2), NUMBER),
    *(output_array(1), output_array(2), output_array(2)),
)
def _move(
    tool: FloatArray,
    rotation: FloatArray,
    centers: FloatArray,
    linear: FloatArray,
    angular: FloatArray,
    own: FloatArray,
    after: float,
    tool_then: FloatArray,
    rotation_then: FloatArray,
    centers_then: FloatArray,
) -> None:
    """Fill the last three: where a tool at (3,), turned by (3, 3), and its spheres' centers (m, 3) are then."""
    turning, origin = load(angular.reshape(1, 3), 0), load(tool.reshape(1, 3), 0)
    axis, half = unit(turning), 0.5 * after * norm(turning)
    sine, versine = math.sin(2.0 * half), 2.0 * math.sin(half) ** 2
    moved = add(origin, scale(after, load(linear.reshape(1, 3), 0)))
    for k in range(3):
        tool_then[k] = moved[k]
        column = _turned((rotation[0, k], rotation[1, k], rotation[2, k]), axis, sine, versine)
        for row in range(3):
            rotation_then[row, k] = column[row]
    for i in range(centers.shape[0]):
        lever = subtract(add(load(centers, i), scale(after, load(own, i))), origin)
        center = add(moved, _turned(lever, axis, sine, versine))
        for row in range(3):
            centers_then[i, row] = center[row]


class FingerMotion:
    """How the spheres move against the tool, by where they were."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, FloatArray]] = deque()

    def see(self, pose: GripperPose, now_s: float) -> FloatArray:
        """Take in a pose; velocities (m, 3) in m/s against the tool, world frame; 0 where there were other spheres."""
        in_tool = np.empty(pose.sphere_centers_m.shape)
        rotation = np.ascontiguousarray(pose.tool_rotation)
        _to_tool(np.ascontiguousarray(pose.sphere_centers_m), pose.tool_position_m, rotation, in_tool)
        if self._seen and self._seen[-1][1].shape != in_tool.shape:
            self._seen.clear()
        self._seen.append((now_s, in_tool))
        while self._seen[0][0] < now_s - _FINGERS_S - 1e-9:
            self._seen.popleft()
        then_s, then = self._seen[0]
        if now_s <= then_s:
            return np.zeros_like(in_tool)
        velocities: FloatArray = np.empty(in_tool.shape)
        _move_in_tool(in_tool, then, now_s - then_s, rotation, velocities)
        return velocities


@compiled(input_array(2), input_array(1), input_array(2), output_array(2))
def _to_tool(centers: FloatArray, tool: FloatArray, rotation: FloatArray, in_tool: FloatArray) -> None:
    """Fill `in_tool` (m, 3): Rᵀ (c - t)."""
    origin = load(tool.reshape(1, 3), 0)
    for i in range(centers.shape[0]):
        lever = subtract(load(centers, i), origin)
        for axis in range(3):
            in_tool[i, axis] = dot(lever, (rotation[0, axis], rotation[1, axis], rotation[2, axis]))


@compiled(input_array(2), input_array(2), NUMBER, input_array(2), output_array(2))
def _move_in_tool(
    now: FloatArray, then: FloatArray, passed: float, rotation: FloatArray, velocities: FloatArray
) -> None:
    """Fill velocities (m, 3), world frame, of what was at `then` and is at `now` in the tool frame; 0 for noise."""
    fastest = 0.0
    for i in range(now.shape[0]):
        moved = scale(1.0 / passed, subtract(load(now, i), load(then, i)))
        for axis in range(3):
            velocities[i, axis] = dot(load(rotation, axis), moved)
            fastest = max(fastest, abs(velocities[i, axis]))
    if not fastest > _NOISE_M_S:
        velocities[:] = 0.0
