"""Words for the codes of a status, as shown in a terminal and a log."""

from enum import StrEnum
from typing import Final

from common.protocol.session import SessionState
from common.status.codes import Doing, LinkState, Phase
from common.status.phase import PhaseFacts
from common.status.statuses import OperatorStatus, RobotStatus

_SAID: Final = {
    Doing.AT_REST_FIRST: "release all but hold-to-run",
    Doing.ALL_KEYS_UP_FIRST: "release all keys for a second",
    Doing.READY: "ready: hold-to-run arms",
    Doing.RUNNING: "driven from a page",
}
_LEASE: Final = {
    SessionState.READY: "ready to arm",
    SessionState.STOPPED_READY: "stopped, ready to arm",
}
_LOST: Final = "nothing heard from the {}"


def words(code: StrEnum | str | None) -> str:
    """Return a code in words; empty for None."""
    return "" if code is None else str(code).replace("_", " ")


def doing_words(doing: Doing) -> str:
    """Return an action in words."""
    return _SAID.get(doing, words(doing))


def lease_words(state: SessionState | None, *, reset_first: bool = False) -> str:
    """Return an operator's state in words; empty for none. reset_first: whether a stop waits for a page's reset."""
    if reset_first and state is SessionState.STOPPED_READY:
        state = SessionState.STOPPED
    return words(state) if state is None else _LEASE.get(state, words(state))


def phase_words(facts: PhaseFacts, side: RobotStatus | OperatorStatus | None) -> tuple[str, str | None]:
    """Return the phase in words, in capitals for an alarm, and the reason or None. side: the status of the link."""
    said, reason = doing_words(facts.doing) if facts.doing else words(facts.phase), facts.reason
    if facts.phase in (Phase.WAITING, Phase.OBSERVING):
        said = link_words(side)
    elif facts.phase is Phase.LINK_LOST and reason is None:
        reason = _LOST.format("operator" if isinstance(side, RobotStatus) else "robot")
    return said.upper() if facts.alarm else said, reason


def link_words(side: RobotStatus | OperatorStatus | None) -> str:
    """Return the link's state in words, without a reason."""
    if side is None:
        return ""
    if side.link is LinkState.WAITING:
        return "waiting for an operator" if isinstance(side, RobotStatus) else "waiting for the robot side"
    if isinstance(side, OperatorStatus) and side.link is LinkState.OBSERVING:
        return f"observing ({side.place} of {side.waiting} waiting)"
    return words(side.link)


def printable(text: str) -> str:
    """Replace each unprintable character, such as a terminal's control characters, by a question mark."""
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "?" for sign in text)
