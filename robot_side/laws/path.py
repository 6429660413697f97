"""Predicted path of the gripper until the arm stands, and waypoints on it from which looks are made.

Sticks move and turn the tool in the tool's own frame, at the velocities v and ω, so the tool makes a screw motion.
After the time t the tool has turned by θ = |ω| t, and the sticks have displaced its point by

    t V v,    V = 1 + (1 - cos θ)/θ [a] + (1 - sin θ/θ) [a]²,    a = ω/|ω|

(exponential map of SE(3)). The trigger moves the tool along its approach axis z, which turns too. So the trigger
displaces it along the chord V z. Where the turn is across z, the chord points along z turned by θ/2. Fingers add their
own motion to their spheres. Onset distances from a waypoint include the distance that commands under way will have
moved the tool by then.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose

SPACING_M: Final = 0.015
"""Largest motion of any sphere between two waypoints: less than the width of an inflated fingertip's sphere. On a path
that would need more than EVEN_WAYPOINTS, they are farther apart."""
EVEN_WAYPOINTS: Final = 8
"""Maximum number of waypoints at equal intervals of time"""
_LEAST_M: Final = 0.003
"""Largest motion of any sphere up to which the path has no waypoints"""
_STRAIGHT: Final = np.eye(3)


@dataclass(frozen=True)
class Drift:
    """Motion of the gripper besides the trigger's, in the world frame."""

    linear_m_s: FloatArray
    """(3,) velocity of the tool's point"""
    turning_rad_s: FloatArray
    """(3,) angular velocity of the tool"""
    fingers_m_s: FloatArray | None = None
    """(m, 3) velocity of each sphere relative to the tool; None while the fingers rest"""


@dataclass(frozen=True)
class Waypoint:
    """Pose to which a drift takes the gripper, and from which looks along the triggers are made."""

    drift: Drift
    after_s: float
    """Time until the gripper is there"""
    moved_s: float
    """Time for which the trigger moves it until then: half a step less, as the look counts for the path from there"""


def fastest_m_s(pose: GripperPose, drift: Drift, ahead_m: float) -> float:
    """Return the largest speed |v + ω × r + own| of all spheres in m/s.

    Each sphere counts at its present position r from the tool, and as if it were displaced by `ahead_m` along the
    approach axis: in a turn, points farther ahead move faster.
    """
    alone = drift.linear_m_s if drift.fingers_m_s is None else drift.linear_m_s + drift.fingers_m_s
    turned = _cross(drift.turning_rad_s).T
    here = alone + (pose.sphere_centers_m - pose.tool_position_m) @ turned
    there = here + ahead_m * (pose.tool_rotation[:, 2] @ turned)
    squares = np.maximum(np.einsum("mi,mi->m", here, here), np.einsum("mi,mi->m", there, there))
    return math.sqrt(float(squares.max(initial=0.0)))


def times_ahead_s(pose: GripperPose, drift: Drift, until_s: float, ahead_m: float) -> tuple[float, ...]:
    """Return the times until the gripper is at the even waypoints on its path; the last is `until_s`. None at rest.

    ahead_m: distance along the approach axis at which the waypoints must be as close together as at the gripper.
    """
    farthest_m = until_s * fastest_m_s(pose, drift, ahead_m)
    if farthest_m < _LEAST_M:
        return ()
    count = min(math.ceil(farthest_m / SPACING_M), EVEN_WAYPOINTS)
    return tuple(until_s * (number + 1) / count for number in range(count))


def waypoints(drift: Drift, times_s: Sequence[float], nearest: int) -> list[Waypoint]:
    """Return the even waypoints, and two more, half a step before and after the one that is nearest to an object.

    nearest: 0 for the present pose, 1 for the first even waypoint. A nearer object may lie between two of them.
    """
    if not times_s:
        return []
    half_s = 0.5 * times_s[0]
    beside = (min(max(2.0 * nearest + side, 1.0), 2.0 * len(times_s) - 1.0) for side in (-1.0, 1.0))
    return [Waypoint(drift, after_s, after_s - half_s) for after_s in (*times_s, *(half_s * one for one in beside))]


def at_waypoint(pose: GripperPose, waypoint: Waypoint, ahead_m: float) -> tuple[GripperPose, FloatArray]:
    """Return the gripper's pose at a waypoint, and the chord (3,): the tool's displacement per metre by the trigger.

    ahead_m: distance along the approach axis by which the trigger has moved the tool until then.
    """
    drift, after_s = waypoint.drift, waypoint.after_s
    turn, screw = _screw(drift.turning_rad_s, after_s)
    chord = screw @ pose.tool_rotation[:, 2]
    tool_m = pose.tool_position_m + after_s * (screw @ drift.linear_m_s) + ahead_m * chord
    levers_m = pose.sphere_centers_m - pose.tool_position_m
    if drift.fingers_m_s is not None:
        levers_m = levers_m + after_s * drift.fingers_m_s
    return (
        GripperPose(
            tool_position_m=tool_m,
            tool_rotation=turn @ pose.tool_rotation,
            tool_jacobian=pose.tool_jacobian,
            sphere_centers_m=tool_m + levers_m @ turn.T,
            sphere_radii_m=pose.sphere_radii_m,
            sphere_on_finger=pose.sphere_on_finger,
        ),
        chord,
    )


def _screw(turning_rad_s: FloatArray, after_s: float) -> tuple[FloatArray, FloatArray]:
    """Return the rotation (3, 3) after a time, and V (3, 3)."""
    rate = math.sqrt(float(turning_rad_s @ turning_rad_s))
    angle = rate * after_s
    if angle <= 1e-9:
        return _STRAIGHT, _STRAIGHT
    axis = _cross(turning_rad_s / rate)
    twice, versine = axis @ axis, 2.0 * math.sin(0.5 * angle) ** 2
    return (
        _STRAIGHT + math.sin(angle) * axis + versine * twice,
        _STRAIGHT + (versine / angle) * axis + (1.0 - math.sin(angle) / angle) * twice,
    )


def _cross(vector: FloatArray) -> FloatArray:
    """Return the matrix [v] (3, 3) with [v] w = v × w."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
