"""Messages of the robot side: stiffness for operators, and telemetry for viewers."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.around import Around
from common.protocol.codec import encode
from common.protocol.messages import Header, MotionState, StiffnessUpdate, Telemetry
from common.protocol.ranges import LATEST_S
from robot_side.arm.hindrance import Hindrance
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.stick_frames import StickFrames
from robot_side.operators.operator_session import Receiver
from robot_side.tick.outgoing import SHOWN_NAME, Outgoing
from robot_side.tick.sensed import Sensed

_AROUND_S: Final = 0.1
_AROUND_AGAIN_S: Final = 0.4
"""Seconds after which an unchanged map is sent again, so that a lost one is replaced"""
_NO_HEADER = Header(0, 0, 0.0)
_FASTEST_M_S, _LARGEST_M = 100.0, 100.0
"""Limits of sent values: even a simulation that is about to become unstable must be able to report its figures."""


class MapSchedule:
    """Schedule of maps in stiffness messages: ten a second while the map changes, otherwise one every 0.4 s."""

    def __init__(self, around: Callable[[GripperPose], Around | None]) -> None:
        """around: returns the map around a pose (`Law.around`)."""
        self._around = around
        self._sent: Around | None = None
        self._sent_s = self._looked_s = -math.inf

    def due(self, pose: GripperPose, now_s: float) -> Around | None:
        """Return the map (`Around`) if it is due, else None."""
        if now_s - self._looked_s < _AROUND_S:
            return None
        self._looked_s, around = now_s, self._around(pose)
        known = self._sent is not None and around is not None and not around.differs(self._sent)
        if around is None or (known and now_s - self._sent_s < _AROUND_AGAIN_S):
            return None
        self._sent, self._sent_s = around, now_s
        return around


def stiffness_message(
    receiver: Receiver,
    sensed: Sensed,
    commanded_m_s: float,
    state: MotionState,
    stands: bool = False,
    hindered: bool = False,
    around: Around | None = None,
    response_s: float = 0.0,
) -> Outgoing:
    """Return the stiffness message for `receiver`; commanded_m_s: commanded speed along R2's direction.

    stands: whether the held object stands on something. hindered: whether something keeps the arm from following.
    around: the map, if one is due in this message. response_s: `JointLimits.response_s`.
    """
    update = StiffnessUpdate(
        receiver.header,
        l2=sensed.l2,
        r2=sensed.r2,
        speed_m_s=sensed.speed_m_s,
        horizon_m=sensed.horizon_m,
        rumble=sensed.rumble,
        state=state,
        commanded_m_s=min(max(commanded_m_s, -_FASTEST_M_S), _FASTEST_M_S),
        stands=stands,
        hindered=hindered,
        around=around,
        response_s=min(response_s, LATEST_S),
    )
    return Outgoing("haptics", receiver.peer, encode(update), receiver.everywhere)


def telemetry(
    state: MotionState,
    pose: GripperPose,
    sensed: Sensed,
    arm: ArmState,
    target: str | None,
    target_m: FloatArray | None,
    hindrance: Hindrance,
    frames: StickFrames | None,
    *,
    holding: bool,
    settled: bool,
) -> Telemetry:
    """Return the telemetry for viewers; its header is filled in later.

    target: the target's name; target_m: its centre (3,), NaN if unknown. settled: whether the loop age is.
    """
    target_in_tool, tool = None, pose.tool_rotation
    faces = frames is not None and frames.camera.faces(tool)
    if target is not None and target_m is not None and np.isfinite(target_m).all():
        target_in_tool = (target_m - pose.tool_position_m) @ pose.tool_rotation
    return Telemetry(
        _NO_HEADER,
        state=state,
        tool_position_m=_vector3(pose.tool_position_m),
        tool_speed_m_s=min(sensed.tool_speed_m_s, _FASTEST_M_S),
        target=None if target is None else target[:SHOWN_NAME],
        target_in_tool_m=None if target_in_tool is None else _vector3(target_in_tool),
        up_in_tool=_vector3(pose.tool_rotation[2]),
        gripper_opening_m=max(0.0, arm.gripper_opening_m),
        holding=holding,
        enlargement_m=min(sensed.enlargement_m, _LARGEST_M) if settled else 0.0,
        l2_course_stiffness=sensed.l2.course_stiffness,
        r2_course_stiffness=sensed.r2.course_stiffness,
        undone=hindrance.undone,
        hindrance=hindrance.text,
        base_turn_rad=0.0 if frames is None else frames.base.turn_rad(tool),
        camera_turn_rad=0.0 if frames is None else frames.camera.turn_rad(tool, mirrored=faces),
        camera_faces=faces,
    )


def _vector3(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return (x, y, z)
