"""State machine of one operator's session at the robot side, as a table that the code executes.

docs/session.md shows the table and its diagram. A pair of state and event that the table lacks changes nothing.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Final


class SessionState(StrEnum):
    """State of one operator's session (one epoch); LeaseNotice sends the values."""

    UNKNOWN = "unknown"
    """No Hello yet, or a refused one."""
    OBSERVING = "observing"
    """Waiting for the lease, which another operator owns."""
    DISARMED = "disarmed"
    """Owner of the lease; the arm is still."""
    READY = "ready"
    """Disarmed, but the arming button arms: for a second commands have come in time, with all inputs at rest."""
    ARMED = "armed"
    """Owner of the lease, whose commands reach the arm."""
    STOPPED = "stopped"
    """Owner of the lease under an emergency stop."""
    STOPPED_READY = "stopped_ready"
    """Stopped, but the arming button arms: for a second commands have come in time, with all inputs at rest."""
    AWAY = "away"
    """Silent and without the lease; the session is remembered, so that the operator can return."""
    ENDED = "ended"
    """Final state: messages of an ended epoch are always refused."""


class SessionEvent(Enum):
    """Event in one operator's session; the values label the arrows of the diagram in docs/session.md."""

    ASKED_WHILE_FREE = "Hello (or any message when away), lease free"
    ASKED_WHILE_HELD = "Hello (or any message when away), lease held"
    ASKED_WHILE_FULL = "Hello, no room for another observer"
    LEASE_PASSED = "lease passed on to it"
    HEALTHY = "healthy second with all inputs at rest"
    ARM = "arming button pressed"
    ARM_EARLY = "arming button pressed too early"
    INPUT_HELD = "trigger, stick, gripper or home held"
    GAP = "no command for longer than the gap limit"
    OLD_LOOP = "loop age over the limit"
    ARM_LOST = "arm's newest state too old"
    ASTRAY = "arm does not do what it is told"
    EMERGENCY_STOP = "emergency stop"
    WRONG_TOKEN = "command with another token"  # noqa: S105  # no password
    HAND_OVER = "hand-over button, somebody waits"
    SILENT = "nothing heard for longer than the lease limit"
    NEW_EPOCH = "another epoch on its connection"
    FORGOTTEN = "room needed"


NOT_ARMED: Final = "not armed"
"""First words of the reason why a press of the arming button did not arm"""

OWNING: Final = frozenset(
    {
        SessionState.DISARMED,
        SessionState.READY,
        SessionState.ARMED,
        SessionState.STOPPED,
        SessionState.STOPPED_READY,
    }
)
"""States in which the operator owns the lease."""


@dataclass(frozen=True)
class Transition:
    """Row of the session's table: `event` in state `before` leads to `after`, for the reason `why`."""

    before: SessionState
    event: SessionEvent
    after: SessionState
    why: str


def _rows(
    before: Iterable[SessionState], event: SessionEvent, after: SessionState | None, why: str
) -> tuple[Transition, ...]:
    """Return one row for each state in `before`, in the order of SessionState. `after` None: the state remains."""
    return tuple(Transition(state, event, after or state, why) for state in SessionState if state in set(before))


_GAP: Final = "no command reached the robot in time"
_OLD_LOOP: Final = "the link's round trip is too long"
_ARM_LOST: Final = "arm lost: nothing new is heard of it"
_ASTRAY: Final = "the arm does not follow"
_INPUT_HELD: Final = "arming needs triggers, sticks, gripper and home at rest"


def _build() -> tuple[Transition, ...]:
    state, event = SessionState, SessionEvent
    strangers = (state.UNKNOWN, state.AWAY)
    known = (state.OBSERVING, *OWNING)
    return (
        *_rows([state.UNKNOWN], event.ASKED_WHILE_FREE, state.DISARMED, "newly connected, so disarmed"),
        *_rows([state.AWAY], event.ASKED_WHILE_FREE, state.DISARMED, "connected again after a silence, so disarmed"),
        *_rows(strangers, event.ASKED_WHILE_HELD, state.OBSERVING, "one owner, many observers"),
        *_rows([state.UNKNOWN], event.ASKED_WHILE_FULL, None, "no room for another observer"),
        *_rows([state.AWAY], event.ASKED_WHILE_FULL, None, "no room for another observer"),
        *_rows([state.OBSERVING], event.LEASE_PASSED, state.DISARMED, "the robot was handed over to you, disarmed"),
        *_rows([state.DISARMED], event.HEALTHY, state.READY, "may be armed"),
        *_rows([state.STOPPED], event.HEALTHY, state.STOPPED_READY, "may be armed again"),
        *_rows([state.READY, state.STOPPED_READY], event.ARM, state.ARMED, "armed on purpose"),
        *_rows([state.DISARMED, state.STOPPED], event.ARM_EARLY, None, NOT_ARMED),
        *_rows([state.READY], event.INPUT_HELD, state.DISARMED, _INPUT_HELD),
        *_rows([state.STOPPED_READY], event.INPUT_HELD, state.STOPPED, _INPUT_HELD),
        *_rows([state.READY, state.ARMED], event.GAP, state.DISARMED, _GAP),
        *_rows([state.STOPPED_READY], event.GAP, state.STOPPED, _GAP),
        *_rows([state.READY, state.ARMED], event.OLD_LOOP, state.DISARMED, _OLD_LOOP),
        *_rows([state.STOPPED_READY], event.OLD_LOOP, state.STOPPED, _OLD_LOOP),
        *_rows([state.DISARMED], event.ARM_LOST, None, _ARM_LOST),
        *_rows([state.READY, state.ARMED], event.ARM_LOST, state.DISARMED, _ARM_LOST),
        *_rows([state.STOPPED_READY], event.ARM_LOST, state.STOPPED, _ARM_LOST),
        *_rows([state.DISARMED], event.ASTRAY, None, _ASTRAY),
        *_rows([state.READY, state.ARMED], event.ASTRAY, state.DISARMED, _ASTRAY),
        *_rows([state.STOPPED_READY], event.ASTRAY, state.STOPPED, _ASTRAY),
        *_rows(OWNING, event.EMERGENCY_STOP, state.STOPPED, "emergency stop"),
        *_rows(known, event.WRONG_TOKEN, None, "a command of an earlier lease was not applied"),
        *_rows(OWNING, event.HAND_OVER, state.OBSERVING, "the owner handed the lease over"),
        *_rows(known, event.SILENT, state.AWAY, "nothing was heard from this operator for too long"),
        *_rows((*known, state.AWAY), event.NEW_EPOCH, state.ENDED, "the operator side began a new epoch"),
        *_rows([state.AWAY], event.FORGOTTEN, state.ENDED, "too many are remembered"),
    )


TRANSITIONS: Final = _build()
TABLE: Final[Mapping[tuple[SessionState, SessionEvent], Transition]] = MappingProxyType(
    {(row.before, row.event): row for row in TRANSITIONS}
)


class Session:
    """Present state of one operator's session."""

    def __init__(self) -> None:
        self.state = SessionState.UNKNOWN
        self.why = "no Hello yet"
        """Reason of the last transition."""

    @property
    def owns(self) -> bool:
        """Whether the operator has the lease."""
        return self.state in OWNING

    def handle(self, event: SessionEvent, why: str | None = None) -> Transition | None:
        """Apply the event; return the table's row for it. Return None, and change nothing, if there is none.

        why: reason in more detail than the row's.
        """
        row = TABLE.get((self.state, event))
        if row is not None:
            self.state, self.why = row.after, why or row.why
        return row
