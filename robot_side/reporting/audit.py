"""What the audit log says of the arm: who armed it, when it was disarmed and why, and who owns the lease."""

from collections.abc import Sequence
from typing import Final, Protocol

from common.sockets.door.messages import Event
from robot_side.operators.operator_session import OperatorSession

_MOST_NAMES: Final = 256


class Log(Protocol):
    """Log of events."""

    def note(self, event: str, **more: str | float) -> None:
        """Add an event with the present time; never waits."""
        ...

    def take_failure(self) -> bool:
        """Return whether an event was lost for the first time since the last call."""
        ...


class Audit:
    """Watches the session, and passes on what the door tells."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._names: dict[bytes, tuple[str, str]] = {}
        """Key's name and address of the peers that are connected"""
        self._owner: bytes | None = None
        self._state = ""

    def _at_the_door(self, event: Event) -> None:
        if event.peer and event.kind == "connected" and len(self._names) < _MOST_NAMES:
            self._names[event.peer] = event.who, event.where
        elif event.kind == "left":
            self._names.pop(event.peer, None)
        self._log.note(event.kind, who=event.who, where=event.where)

    def look(self, session: OperatorSession, events: Sequence[Event]) -> list[str]:
        """Log `events` at the ports, and what changed in the session: the lease's owner, whether the arm is armed.

        Return lines to show: that events are lost, once.
        """
        for event in events:
            self._at_the_door(event)
        owner, state = session.owner_peer, session.safety.state
        if owner != self._owner and (owner is None or owner in self._names):
            self._owner = owner
            if owner is None:
                self._log.note("lease free")
            else:
                self._note("lease", owner)
        if state != self._state:
            armed_before, self._state = self._state == "armed", state
            if state == "armed" and owner is not None:
                self._note("armed", owner)
            elif armed_before:
                stops = session.safety.stops
                self._log.note("disarmed", why=str(stops[-1][1]) if stops else "")
        return ["--audit: events are lost, as the disk refuses them"] if self._log.take_failure() else []

    def _note(self, event: str, peer: bytes) -> None:
        who, where = self._names.get(peer, ("", ""))
        self._log.note(event, who=who, where=where)
