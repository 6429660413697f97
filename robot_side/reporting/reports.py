"""Messages of one tick: answers and stiffness for operators; and telemetry for viewers, after these have left."""

from collections.abc import Callable
from typing import Final

import msgspec
import numpy as np

from common.arrays import FloatArray
from common.protocol.around import Around
from common.protocol.codec import encode
from common.protocol.messages import MotionState
from robot_side.arm.hindrance import Hindrance
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.stick_frames import StickFrames
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Permission
from robot_side.reporting.outgoing_messages import MapSchedule, stiffness_message, telemetry
from robot_side.reporting.perceptual_deadband import StiffnessDeadband, TelemetryDeadband
from robot_side.tick.outgoing import Outgoing
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

OBSERVER_PERIOD_S: Final = 0.02
"""Period of the stiffness messages to observers, in seconds"""


class Reports:
    """Choice of the messages that are due in a tick, by deadbands and schedules."""

    def __init__(
        self,
        session: OperatorSession,
        around: Callable[[GripperPose], Around | None],
        frames: StickFrames | None = None,
        *,
        full_rate: bool = False,
    ) -> None:
        """around: `Law.around`. full_rate: send a stiffness message in every tick."""
        self.stiffness_sent = 0
        self.turns_with_owner = 0
        """Number of turns in which a stiffness message could have left: there was an owner of the lease"""
        self.deadband = StiffnessDeadband(full_rate=full_rate)
        """Deadband that decides when a stiffness message to the lease's owner leaves"""
        self._session, self._law_around, self._frames = session, around, frames
        self._around, self._seen = MapSchedule(around), TelemetryDeadband()
        self._next_observers_s = -np.inf

    def begin_epoch(self) -> None:
        """Begin with another owner of the lease, to which nothing has been sent yet."""
        self.deadband.forget()
        self._around = MapSchedule(self._law_around)

    def outgoing(
        self,
        permission: Permission,
        situation: Situation,
        sensed: Sensed,
        commanded_m_s: float,
        stands: bool,
        hindered: bool,
        now_s: float,
    ) -> list[Outgoing]:
        """Return the messages to operators that are due at `now_s`; see `stiffness_message`."""
        session = self._session
        content = sensed, commanded_m_s, permission.state, stands, hindered
        outgoing = [Outgoing("haptics", *answer) for answer in session.take_answers(now_s)]
        self.turns_with_owner += session.owner_peer is not None
        self.deadband.response_s = situation.response_s
        if session.owner_peer is not None and self.deadband.due(*content, permission.command, now_s):
            self.stiffness_sent += 1
            around = self._around.due(situation.pose, now_s)
            outgoing += [
                stiffness_message(one, *content, around, situation.response_s) for one in session.owners(now_s)
            ]
        if now_s >= self._next_observers_s:
            self._next_observers_s = now_s + OBSERVER_PERIOD_S
            outgoing += [
                stiffness_message(one, *content, None, situation.response_s) for one in session.observers(now_s)
            ]
        return outgoing

    def telemetry(
        self,
        state: MotionState,
        situation: Situation,
        sensed: Sensed,
        arm: ArmState,
        target: str | None,
        target_m: FloatArray | None,
        hindrance: Hindrance,
        now_s: float,
    ) -> list[Outgoing]:
        """Return the telemetry of a tick's results, if it is due at `now_s`.

        target: the target's name; target_m: its centre (3,), NaN if unknown.
        """
        holding = situation.held is not None
        if not self._seen.may_be_due((self._session.lease.token, state, target, holding, hindrance.text), now_s):
            return []
        shown = state, situation.pose, sensed, arm, target, target_m, hindrance, self._frames
        view = telemetry(*shown, holding=holding, settled=situation.loop_age_settled)
        if not self._seen.due(view, now_s):
            return []
        view = msgspec.structs.replace(view, header=self._session.shown_header(now_s))
        return [Outgoing("telemetry", b"", encode(view))]
