"""Small motions by which a person sees whether joints, signs, zero offsets and gripper are as the model says."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.stick_frames import Frame
from robot_side.commissioning.procedure import SLIDE_M_PER_RAD, Motion, Procedure, Seen

NUDGE_RAD: Final = math.radians(2.0)
_RATE_RAD_S: Final = 0.05
_MIRRORED: Final = -0.3
_MOST: Final = 1.5
_LEAST_BACK: Final = 0.1
"""Shares of its way: by which a joint that moves the other way is stopped, by which any joint is, and that matters"""
_SETTLES_S: Final = 0.6
_LISTENS_S: Final = 2.0
_CLOSING: Final = 0.3
_UNCHANGED_M: Final = 0.0003
_UNCHANGED_S: Final = 0.8
_GRIPPER_S: Final = 15.0
"""Longest time for the gripper to close or to open"""
_TURNS: Final = (
    ("tips up", "tips down"),
    ("turns to its right", "turns to its left"),
    ("rolls clockwise, seen from behind it", "rolls anticlockwise, seen from behind it"),
)
"""Words for turns about the tool's axes (right, down, ahead), forth and back"""
_SHOWN_M: Final = 0.001
"""Least motion of the tool that a person can see"""


@dataclass(frozen=True)
class Heard:
    """Figures of a resting arm's states."""

    states_per_s: float
    oldest_s: float
    """Greatest age of the newest state"""
    noise_rad: FloatArray
    """(n,) standard deviation of each joint's readings"""
    loads_nm: FloatArray | None
    """(n,) mean loads; None if the arm does not measure them"""
    state: ArmState


@dataclass(frozen=True)
class Nudged:
    """One joint's small motion, by the measured positions."""

    asked_rad: float
    moved_rad: FloatArray
    """(n,) motion of each joint"""
    before: ArmState
    after: ArmState


def listen(joints: int) -> Procedure[Heard]:
    """Stand for two seconds and listen."""
    seen = yield Motion(np.zeros(joints))
    begin_s, states, oldest_s = seen.now_s, [seen.state], 0.0
    while seen.now_s - begin_s < _LISTENS_S:
        seen = yield Motion(np.zeros(joints))
        oldest_s = max(oldest_s, seen.now_s - seen.state.time_s)
        if seen.state.time_s > states[-1].time_s:
            states.append(seen.state)
    positions = np.array([state.joint_positions_rad for state in states])
    loads = [state.joint_loads_nm for state in states if state.joint_loads_nm is not None]
    passed_s = max(states[-1].time_s - states[0].time_s, 1e-9)
    return Heard(
        (len(states) - 1) / passed_s,
        oldest_s,
        positions.std(axis=0),
        np.mean(loads, axis=0) if loads else None,
        states[-1],
    )


def nudge(joint: int, limits: JointLimits, *, back_from: Nudged | None = None) -> Procedure[Nudged]:
    """Move one joint slowly by 2 degrees (5 mm where it slides), away from the nearer end of its range.

    back_from: an earlier motion, which this one undoes. A joint that moves the other way is stopped at a third of it,
    and so are all when another one moves farther.
    """
    joints = limits.velocity_rad_s.size
    slides = bool(np.broadcast_to(limits.slides, joints)[joint])
    scale = SLIDE_M_PER_RAD if slides else 1.0
    stands, command = Motion(np.zeros(joints)), np.zeros(joints)
    seen = yield stands
    before = seen.state
    position = float(before.joint_positions_rad[joint])
    lower, upper = (float(end[joint]) for end in limits.ends_rad)
    way = NUDGE_RAD * scale * (1.0 if upper - position >= position - lower else -1.0)
    if back_from is not None:
        way = float(back_from.before.joint_positions_rad[joint]) - position
        if abs(way) < _LEAST_BACK * NUDGE_RAD * scale:  # it stands where it was, as far as readings tell
            return Nudged(way, np.zeros(joints), before, before)
    command[joint] = math.copysign(min(_RATE_RAD_S * scale, float(limits.velocity_rad_s[joint])), way)
    until_s = seen.now_s + 2.0 * abs(way / command[joint]) + _SETTLES_S
    scales = np.where(np.broadcast_to(limits.slides, joints), SLIDE_M_PER_RAD, 1.0)
    while seen.now_s < until_s:
        moved = seen.state.joint_positions_rad - before.joint_positions_rad
        if not _MIRRORED < moved[joint] / way < 1.0 or (np.abs(moved / scales) > _MOST * NUDGE_RAD).any():
            break
        seen = yield Motion(command)
    until_s = seen.now_s + _SETTLES_S
    while seen.now_s < until_s:
        seen = yield stands
    return Nudged(way, seen.state.joint_positions_rad - before.joint_positions_rad, before, seen.state)


def drive_gripper(joints: int, *, closes: bool) -> Procedure[ArmState]:
    """Close or open the gripper slowly until its opening no longer changes; return the last state."""
    motion = Motion(np.zeros(joints), _CLOSING if closes else -_CLOSING)
    seen: Seen = yield motion
    begin_s = since_s = seen.now_s
    opening_m = seen.state.gripper_opening_m
    while seen.now_s - since_s < _UNCHANGED_S and seen.now_s - begin_s < _GRIPPER_S:
        seen = yield motion
        if abs(seen.state.gripper_opening_m - opening_m) > _UNCHANGED_M:
            opening_m, since_s = seen.state.gripper_opening_m, seen.now_s
    return seen.state


def motion_in_words(before: GripperPose, after: GripperPose, base: Frame) -> str:
    """Return how the tool moved, as a person who looks from the base towards the tool's start sees it."""
    moved_m = after.tool_position_m - before.tool_position_m
    if np.linalg.norm(moved_m) >= _SHOWN_M:
        return f"the tool moves {place_in_words(moved_m, base)}"
    turn = before.tool_rotation.T @ after.tool_rotation
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    axis = int(np.abs(vector).argmax())
    if abs(vector[axis]) < 0.2 * NUDGE_RAD:
        return "the tool does not move"
    way = _TURNS[axis][int(vector[axis] < 0.0)]
    return f"the tool {way}, by {math.degrees(abs(vector[axis])):.1f}°"


def place_in_words(vector_m: FloatArray, base: Frame) -> str:
    """Return a vector (3,) of the world as ways in millimetres, the longest first."""
    parts = [
        (float(axis @ vector_m), words)
        for axis, words in (
            (base.up, ("up", "down")),
            (base.right, ("right", "left")),
            (base.ahead, ("ahead", "back")),
        )
    ]
    parts.sort(key=lambda part: -abs(part[0]))
    shown = [part for part in parts if abs(part[0]) >= max(0.25 * abs(parts[0][0]), 0.5e-3)] or parts[:1]
    return ", ".join(f"{words[int(way_m < 0.0)]} by {1e3 * abs(way_m):.0f} mm" for way_m, words in shown)
