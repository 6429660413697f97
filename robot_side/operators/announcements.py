"""Messages to operators besides stiffness: Hello, and notices that tell each operator its place with the lease."""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Header, LeaseNotice
from common.protocol.session import SessionState
from robot_side.operators.lease import Lease, Participant
from robot_side.operators.tuning import Tuning

_NOTICE_PERIOD_S = 0.1
_ANSWER_PERIOD_S = 0.1


class Answer(NamedTuple):
    """Payload that is to be sent to `peer`."""

    peer: bytes
    payload: bytes
    everywhere: bool
    """Whether to send over every connection, because the payload has new content"""


class Announcements:
    """Answers to Hellos, and lease notices, at a bounded rate even if many strangers ask."""

    def __init__(self, new_link: Callable[[], LinkEnd], lease: Lease, tuning: Tuning) -> None:
        self._lease = lease
        self._tuning = tuning
        self._link = new_link()
        self._sequence, self._shown = itertools.count(1), itertools.count(1)
        self._answers: list[Answer] = []
        self._answered_stranger_s = -math.inf
        self._noticed_s = -math.inf
        self._noticed: list[tuple[int, SessionState, int, tuple[int, str]]] = []
        self._noticed_token = 0

    def stamp(self, now_s: float, link: LinkEnd | None = None) -> Header:
        """Return the next header of our epoch, from one sequence for all receivers.

        link: our end of the link to the receiver; None: for no particular receiver.
        """
        return (link or self._link).stamp(now_s, next(self._sequence))

    def stamp_shown(self, now_s: float) -> Header:
        """Return the header of the next message made between ticks; these have their own sequence numbers."""
        return self._link.stamp(now_s, next(self._shown))

    def answer(self, participant: Participant, now_s: float) -> None:
        """Answer a Hello with our Hello and a lease notice, at a bounded rate."""
        if now_s - participant.answered_s < _ANSWER_PERIOD_S:
            return
        participant.answered_s = now_s
        self._hello(participant.peer, participant.link, now_s)
        self._notice(participant, now_s)

    def refuse(self, peer: bytes, session: SessionState, why: str, now_s: float) -> None:
        """Answer a refused peer with our Hello and the reason, at a bounded rate."""
        if now_s - self._answered_stranger_s < _ANSWER_PERIOD_S:
            return
        self._answered_stranger_s = now_s
        self._hello(peer, self._link, now_s)
        waiting, is_free = len(self._lease.observers()), self._lease.owner is None
        place = 0 if is_free else waiting + 1
        header, token = self.stamp(now_s), self._lease.token
        notice = LeaseNotice(header, session=session, why=why, token=token, waiting=waiting, place=place)
        self._answers.append(Answer(peer, encode(notice), everywhere=True))

    def take(self, now_s: float) -> list[Answer]:
        """Return the answers to send now. Lease notices for all are added when one changed, and every 0.1 s."""
        standing = [(one.epoch, one.session.state, one.tuned, one.marked) for one in self._lease.present()]
        changed = standing != self._noticed or self._lease.token != self._noticed_token
        if changed or now_s - self._noticed_s >= _NOTICE_PERIOD_S:
            self._noticed_s, self._noticed, self._noticed_token = now_s, standing, self._lease.token
            for participant in self._lease.present():
                self._notice(participant, now_s)
        answers, self._answers = self._answers, []
        return answers

    def _hello(self, peer: bytes, link: LinkEnd, now_s: float) -> None:
        self._answers.append(Answer(peer, encode(link.hello(now_s, next(self._sequence))), everywhere=True))

    def _notice(self, participant: Participant, now_s: float) -> None:
        observers = self._lease.observers()
        notice = LeaseNotice(
            self.stamp(now_s, participant.link),
            session=participant.state,
            why=participant.session.why,
            token=self._lease.token,
            waiting=len(observers),
            place=observers.index(participant) + 1 if participant in observers else 0,
            may_tune=self._tuning.permitted,
            probability=self._tuning.probability,
            tuned=participant.tuned,
            marked=participant.marked[0],
            mark_refused=participant.marked[1],
        )
        _, *said = msgspec.structs.astuple(notice)
        self._answers.append(Answer(participant.peer, encode(notice), everywhere=said != participant.noticed))
        participant.noticed = said
