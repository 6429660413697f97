"""Phase of a run from both sides' status. Only this file has the order of severity of the phases."""

import msgspec

from common.protocol.session import SessionState
from common.status.codes import Border, ConnectionState, Doing, LinkState, Phase, Sight
from common.status.statuses import OperatorStatus, RobotStatus

_UP_TO_ARMED = (None, Doing.RESTING, Doing.ARMING)
"""Actions of the simulated person until they have seen that the arm is armed."""
_LOST = (Phase.LINK_LOST, Phase.REFUSED, Phase.CONTROLLER_LOST)
_READY = (SessionState.READY, SessionState.STOPPED_READY)
_NOBODY = OperatorStatus()


class PhaseFacts(msgspec.Struct, frozen=True):
    """Phase of a run, with its reason and the state that the page's border shows."""

    phase: Phase = Phase.STARTING
    doing: Doing | None = None
    """Action of the person or page, if the phase is BUSY"""
    reason: str | None = None
    """Reason of the phase, for people, if a side gives one"""
    alarm: bool = False
    """Whether something unintended keeps the arm from moving"""
    border: Border = Border.STARTING


def phase_of(robot: RobotStatus | None, operator: OperatorStatus | None) -> PhaseFacts:
    """Return the phase from the status of each side; None: that side's status is unknown."""
    side, hands = operator or robot, operator or _NOBODY
    if side is None:
        return PhaseFacts()
    link, state, because = side.link, side.state, (robot or side).stopped_because
    if state == "stopped" and hands.stop_reset:
        state, because = "disarmed", None
    alarms: tuple[tuple[bool, Phase, str | None], ...] = (
        (link is LinkState.LOST, Phase.LINK_LOST, hands.link_reason),
        (link is LinkState.REFUSED, Phase.REFUSED, hands.link_reason),
        (state == "stopped", Phase.STOPPED, because),
        (hands.controller is ConnectionState.LOST, Phase.CONTROLLER_LOST, None),
        (state == "armed" and hands.feel is Sight.WAITING, Phase.RELEASE_BOTH_TRIGGERS, None),
        (state == "disarmed" and because is not None, Phase.DISARMED, because),
    )
    others: tuple[tuple[bool, Phase, str | None], ...] = (
        (link is LinkState.WAITING, Phase.WAITING, hands.link_reason),
        (link is LinkState.OBSERVING, Phase.OBSERVING, None),
        (hands.controller is ConnectionState.ABSENT, Phase.NO_CONTROLLER, None),
        (state == "armed" and hands.person in _UP_TO_ARMED, Phase.ARMED, None),
        (hands.person is not None, Phase.BUSY, None),
        (state == "disarmed" and side.owner in _READY, Phase.READY_TO_ARM, None),
        (state == "disarmed", Phase.DISARMED, None),
        (True, Phase.STARTING, None),
    )
    place = next(place for place, (holds, _, _) in enumerate(alarms + others) if holds)
    _, phase, reason = (alarms + others)[place]
    border = Border.LOST if phase in _LOST else Border.STARTING if state is None else Border(state)
    return PhaseFacts(phase, hands.person if phase is Phase.BUSY else None, reason, place < len(alarms), border)
