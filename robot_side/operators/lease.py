"""The lease of the arm: one owner with a fencing token that only grows, and a bounded number of observers."""

import math
from collections import deque
from collections.abc import Iterator

from common.protocol.link_end import LinkEnd
from common.protocol.messages import MotionState
from common.protocol.session import Session, SessionEvent, SessionState
from robot_side.operators.safety import Safety


class Participant:
    """One epoch of one operator side."""

    def __init__(self, epoch: int, peer: bytes, link: LinkEnd, now_s: float) -> None:
        self.epoch = epoch
        self.link = link
        self.session = Session()
        self.peer = peer
        """The connection that its newest message came over."""
        self.heard_s = now_s
        self.waiting_since_s = now_s
        """Since when it observes; the longest is the next to own."""
        self.answered_s = -math.inf
        """When its Hello was answered last."""
        self.next_target_was_down = True
        self.hand_over_was_down = True
        self.told_state: MotionState | None = None
        """The arm's, as it was told last with a stiffness."""
        self.noticed: list[object] = []
        """What it was told last of the lease."""
        self.tuned = 0
        """The number of its newest wish to tune."""

    @property
    def state(self) -> SessionState:
        """Its session's."""
        return self.session.state


MOST_OBSERVERS = 8
MOST_AWAY = 8
"""Operators that went away and are remembered, the newest; memory stays bounded however many come and go."""
_ENDED_EPOCHS = 64


class Lease:
    """Passes the arm from operator to operator; each one that gets it begins disarmed."""

    def __init__(self, safety: Safety) -> None:
        self.token = 0
        """Current or latest lease token; 0 before the first."""
        self.stale = 0
        """Late messages of operators that are forgotten by now."""
        self._safety = safety
        self._participants: dict[int, Participant] = {}
        self._owner: Participant | None = None
        self._ended: deque[int] = deque(maxlen=_ENDED_EPOCHS)

    @property
    def owner(self) -> Participant | None:
        """The one whose commands count; None while the lease is free."""
        return self._owner

    def find(self, epoch: int) -> Participant | None:
        """The operator of this epoch, unless it is unknown or forgotten."""
        return self._participants.get(epoch)

    def has_ended(self, epoch: int) -> bool:
        """Whether this epoch is over: it never comes back."""
        return epoch in self._ended

    def observers(self) -> list[Participant]:
        """Those who wait, the longest first."""
        waiting = [one for one in self._participants.values() if one.state is SessionState.OBSERVING]
        return sorted(waiting, key=lambda one: one.waiting_since_s)

    def present(self) -> list[Participant]:
        """The owner and the observers."""
        return [one for one in self._participants.values() if one.session.state is not SessionState.AWAY]

    def known(self) -> Iterator[Participant]:
        """All remembered operators."""
        return iter(self._participants.values())

    def ask(self, participant: Participant, now_s: float) -> bool:
        """Grant the lease when it is free, else let it observe; False when there is no room for another observer."""
        if self._owner is None:
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
        """Pass the lease on to the observer that has waited longest; False and no change when nobody waits."""
        if self._owner is None or not self._alive(self.observers(), now_s):
            return False
        self._owner.waiting_since_s = now_s
        self._release(SessionEvent.HAND_OVER, now_s)
        return True

    def end_epoch_of(self, peer: bytes, epoch: int, now_s: float) -> None:
        """Another epoch than `epoch` that came over the same connection is over: its process restarted."""
        for one in [one for one in self._participants.values() if one.peer == peer and one.epoch != epoch]:
            self._forget(one, SessionEvent.NEW_EPOCH, now_s)

    def expire(self, now_s: float) -> None:
        """Drop participants that were silent for `lease_s` or longer."""
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
        # Milliseconds of the monotonic clock keep it growing even when this process restarts.
        self.token = max(self.token + 1, int(1e3 * now_s))
        self._owner = participant
        self._safety.begin(participant.session)

    def _release(self, event: SessionEvent, now_s: float) -> None:
        waiting = self.observers()
        self._safety.end(event, now_s)
        self._owner = None
        # An observer that has just fallen silent, too, would only hold it up.
        alive = self._alive(waiting, now_s)
        if alive:
            alive[0].session.handle(SessionEvent.LEASE_PASSED)
            self._own(alive[0], now_s)

    def _alive(self, participants: list[Participant], now_s: float) -> list[Participant]:
        return [one for one in participants if now_s - one.heard_s < self._safety.settings.lease_s]

    def _forget(self, participant: Participant, event: SessionEvent, now_s: float) -> None:
        if participant is self._owner:
            self._release(event, now_s)
        else:
            participant.session.handle(event)
        self.stale += participant.link.stale
        del self._participants[participant.epoch]
        self._ended.append(participant.epoch)
