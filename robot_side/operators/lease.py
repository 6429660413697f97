"""Lease of the arm: one owner with a fencing token that only grows, and a bounded number of observers."""

import math
from collections import deque
from collections.abc import Iterator

from common.peer_name import may_drive
from common.protocol.link_end import LinkEnd
from common.protocol.messages import MotionState
from common.protocol.session import Session, SessionEvent, SessionState
from robot_side.operators.safety import Safety


class Participant:
    """Operator side in one of its epochs."""

    def __init__(self, epoch: int, peer: bytes, link: LinkEnd, now_s: float) -> None:
        self.epoch = epoch
        self.link = link
        self.session = Session()
        self.peer = peer
        """Connection over which its newest message came"""
        self.heard_s = now_s
        self.waiting_since_s = now_s
        """Time since which it observes; the observer that has waited longest is the next owner"""
        self.answered_s = -math.inf
        """Time of the last answer to its Hello"""
        self.next_target_was_down = True
        self.hand_over_was_down = True
        self.told_state: MotionState | None = None
        """State of the robot in the last stiffness message sent to this operator"""
        self.noticed: list[object] = []
        """Content of the last lease notice sent to this operator"""
        self.tuned = 0
        """Number of its newest request to tune"""
        self.marked = 0, ""
        """Number of its newest mark of an episode, and why that was refused; empty if it was accepted"""

    @property
    def state(self) -> SessionState:
        """State of the session"""
        return self.session.state


MOST_OBSERVERS = 8
MOST_AWAY = 8
"""Maximum number of absent operators that are remembered, the newest; this bounds the memory."""
_ENDED_EPOCHS = 64


class Lease:
    """Lease of the arm, passed from operator to operator; each new owner begins disarmed."""

    def __init__(self, safety: Safety) -> None:
        self.token = 0
        """Current or latest lease token; 0 before the first lease"""
        self.stale = 0
        """Number of messages that came too late, of operators that are forgotten by now"""
        self._safety = safety
        self._participants: dict[int, Participant] = {}
        self._owner: Participant | None = None
        self._ended: deque[int] = deque(maxlen=_ENDED_EPOCHS)

    @property
    def owner(self) -> Participant | None:
        """Operator whose commands count; None while the lease is free."""
        return self._owner

    def find(self, epoch: int) -> Participant | None:
        """Return the operator with this epoch; None if the epoch is unknown or forgotten."""
        return self._participants.get(epoch)

    def has_ended(self, epoch: int) -> bool:
        """Return whether this epoch has ended; an ended epoch is never admitted again."""
        return epoch in self._ended

    def observers(self) -> list[Participant]:
        """Return the observers; the one that has waited longest comes first."""
        waiting = [one for one in self._participants.values() if one.state is SessionState.OBSERVING]
        return sorted(waiting, key=lambda one: one.waiting_since_s)

    def present(self) -> list[Participant]:
        """Return the owner and the observers."""
        return [one for one in self._participants.values() if one.session.state is not SessionState.AWAY]

    def known(self) -> Iterator[Participant]:
        """Return all remembered operators."""
        return iter(self._participants.values())

    def ask(self, participant: Participant, now_s: float) -> bool:
        """Grant the lease if it is free, else admit the participant as an observer; False without room for another.

        A participant whose key may only observe never gets it.
        """
        if self._owner is None and may_drive(participant.peer):
            participant.session.handle(SessionEvent.ASKED_WHILE_FREE)
            self._own(participant, now_s)
        elif len(self.observers()) < MOST_OBSERVERS:
            participant.session.handle(SessionEvent.ASKED_WHILE_HELD)
            participant.waiting_since_s = now_s
        else:
            participant.session.handle(SessionEvent.ASKED_WHILE_FULL)
            return False
        self._participants[participant.epoch] = participant
        return True

    def hand_over(self, now_s: float) -> bool:
        """Pass the lease to the observer that has waited longest; return False, and change nothing, if nobody waits."""
        if self._owner is None or not self._alive(self.observers(), now_s):
            return False
        self._owner.waiting_since_s = now_s
        self._release(SessionEvent.HAND_OVER, now_s)
        return True

    def end_epoch_of(self, peer: bytes, epoch: int, now_s: float) -> None:
        """End all epochs of the connection `peer` other than `epoch`: its process has restarted."""
        for one in [one for one in self._participants.values() if one.peer == peer and one.epoch != epoch]:
            self._forget(one, SessionEvent.NEW_EPOCH, now_s)

    def expire(self, now_s: float) -> None:
        """Mark participants as away after `lease_s` of silence; forget those away but the newest `MOST_AWAY`."""
        limit_s = self._safety.settings.lease_s
        for one in self._participants.values():
            if now_s - one.heard_s >= limit_s and one.state is not SessionState.AWAY:
                if one is self._owner:
                    self._release(SessionEvent.SILENT, now_s)
                else:
                    one.session.handle(SessionEvent.SILENT)
        if len(self._participants) > MOST_AWAY:
            away = [one for one in self._participants.values() if one.state is SessionState.AWAY]
            away.sort(key=lambda one: one.heard_s)
            for one in away[: max(0, len(away) - MOST_AWAY)]:
                self._forget(one, SessionEvent.FORGOTTEN, now_s)

    def _own(self, participant: Participant, now_s: float) -> None:
        # Milliseconds of the monotonic clock: the token grows even when this process restarts.
        self.token = max(self.token + 1, int(1e3 * now_s))
        self._owner = participant
        self._safety.begin(participant.session)

    def _release(self, event: SessionEvent, now_s: float) -> None:
        waiting = self.observers()
        self._safety.end(event, now_s)
        self._owner = None
        # A silent observer would only keep the lease from others.
        alive = self._alive(waiting, now_s)
        if alive:
            alive[0].session.handle(SessionEvent.LEASE_PASSED)
            self._own(alive[0], now_s)

    def _alive(self, participants: list[Participant], now_s: float) -> list[Participant]:
        limit_s = self._safety.settings.lease_s
        return [one for one in participants if now_s - one.heard_s < limit_s and may_drive(one.peer)]

    def _forget(self, participant: Participant, event: SessionEvent, now_s: float) -> None:
        if participant is self._owner:
            self._release(event, now_s)
        else:
            participant.session.handle(event)
        self.stale += participant.link.stale
        del self._participants[participant.epoch]
        self._ended.append(participant.epoch)
