"""Messages of one tick: answers, stiffness for operators, and telemetry for viewers."""

from typing import Final

import msgspec
import numpy as np

from common.protocol.codec import encode
from robot_side.arm.port import ArmState
from robot_side.arm.stick_frames import StickFrames
from robot_side.gripper.grip import Grip
from robot_side.laws.law import Law, Situation
from robot_side.laws.sensed import Sensed
from robot_side.motion import Motion
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Permission
from robot_side.reporting.outgoing_messages import MapSchedule, Outgoing, stiffness_message, telemetry
from robot_side.reporting.perceptual_deadband import StiffnessDeadband, TelemetryDeadband
from robot_side.surroundings.surroundings import Sight

OBSERVER_PERIOD_S: Final = 0.02
"""Period of the stiffness messages to observers, in seconds"""


class Reports:
    """Choice of the messages that are due in a tick, by deadbands and schedules."""

    def __init__(
        self, session: OperatorSession, law: Law, frames: StickFrames | None = None, *, full_rate: bool = False
    ) -> None:
        """full_rate: send a stiffness message in every tick."""
        self.stiffness_sent = 0
        self.felt = StiffnessDeadband(full_rate=full_rate)
        """Deadband that decides when a stiffness message to the lease's owner leaves"""
        self._session, self._law, self._frames = session, law, frames
        self._around, self._seen = MapSchedule(), TelemetryDeadband()
        self._next_observers_s = -np.inf

    def begin_epoch(self) -> None:
        """Begin with another owner of the lease, to which nothing has been sent yet."""
        self.felt.forget()
        self._around = MapSchedule()

    def outgoing(
        self,
        permission: Permission,
        situation: Situation,
        state: ArmState,
        sensed: Sensed,
        parts: tuple[Sight, Grip, Motion],
        now_s: float,
    ) -> list[Outgoing]:
        """Return the messages that are due at `now_s`."""
        session, (sight, grip, motion) = self._session, parts
        hindrance = motion.hindrance
        felt = sensed, motion.told_m_s, permission.state, grip.touchdown.stands, hindrance.text is not None
        outgoing = [Outgoing("haptics", *answer) for answer in session.take_answers(now_s)]
        if session.owner_peer is not None and self.felt.due(*felt, permission.command, now_s):
            self.stiffness_sent += 1
            around = self._around.due(self._law, situation.pose, now_s)
            outgoing += [stiffness_message(one, *felt, around) for one in session.owners(now_s)]
        if now_s >= self._next_observers_s:
            self._next_observers_s = now_s + OBSERVER_PERIOD_S
            outgoing += [stiffness_message(one, *felt) for one in session.observers(now_s)]
        holding = grip.held is not None
        if self._seen.may_be_due((session.lease.token, permission.state, sight.target, holding, hindrance.text), now_s):
            target = None if sight.target is None else (situation.objects.names[sight.target], sight.target_m)
            settled = situation.loop_age_settled
            shown = permission.state, situation.pose, sensed, state, target, hindrance, self._frames
            view = telemetry(*shown, holding=holding, settled=settled)
            if self._seen.due(view, now_s):
                view = msgspec.structs.replace(view, header=session.view_header(now_s))
                outgoing.append(Outgoing("telemetry", b"", encode(view)))
        return outgoing
