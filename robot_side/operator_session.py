"""Which operator the robot side listens to, and the newest that it said."""

import math
from dataclasses import dataclass

from common.codec import decode, encode
from common.errors import RemoteProtocolError
from common.link_end import LinkEnd
from common.messages import AnyMessage, Hello, MotionCommand
from common.statistics import RunningStatistics
from robot_side.safety import Permission, Safety

OPERATOR_SILENT_S = 1.0
"""An operator that has not been heard of for so long no longer keeps others out."""
_ANSWER_PERIOD_S = 0.1


@dataclass(frozen=True)
class Answer:
    """A payload for `peer`."""

    peer: bytes
    payload: bytes


class OperatorSession:
    """One operator at a time: admits, orders and judges what arrives, and forgets all of it in a new epoch."""

    def __init__(self, link: LinkEnd, safety: Safety, seed: int = 0) -> None:
        self.link = link
        self.safety = safety
        self.rejected = 0
        """Payloads that were no valid message, or not the operator's."""
        self.motion_received = 0
        self.applied_age = RunningStatistics(seed)
        """Age in seconds of the command that moves the arm, in every tick in which one does."""
        self._peer: bytes | None = None
        self._heard_s = -math.inf
        self._answers: list[Answer] = []
        self._answered_s = -math.inf
        self._began = False
        self._echoed_s: float | None = None
        self._sent_s: float | None = None
        self._next_target_was_down = False
        self._next_target_pressed = False

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take one control payload from `peer`; what is invalid, late or not the operator's never gets further."""
        try:
            message = decode(payload)
        except RemoteProtocolError:
            self.rejected += 1
            return
        if not isinstance(message, Hello | MotionCommand) or (isinstance(message, Hello) and message.side == "robot"):
            self.rejected += 1
            return
        known = message.header.epoch == self.link.peer_epoch
        if not known and not self._admits(message, now_s):
            self._answer_hello(peer, now_s)
            self.rejected += 1
            return
        arrival = self.link.arrived(message, now_s)
        if message.header.epoch != self.link.peer_epoch:
            self.rejected += 1  # an epoch that has ended
            return
        if not known:
            self._begin_epoch(now_s)
        # The same operator may come back over another connection.
        self._peer, self._heard_s = peer, now_s
        if isinstance(message, Hello):
            self._answer_hello(peer, now_s)
            return
        self.motion_received += 1
        if self.safety.receive(message, arrival, now_s):
            # Both on our own clock, so that they age from tick to tick.
            self._echoed_s = None if arrival.loop_age_s is None else now_s - arrival.loop_age_s
            self._sent_s = None if arrival.one_way_s is None else now_s - arrival.one_way_s
            self._next_target_pressed |= message.next_target and not self._next_target_was_down
            self._next_target_was_down = message.next_target

    def operator(self, now_s: float) -> bytes | None:
        """Where to send what the operator is to feel; None while there is nobody."""
        return self._peer if now_s - self._heard_s <= OPERATOR_SILENT_S else None

    def loop_age_s(self, now_s: float) -> float | None:
        """How old the stamp of ours is that the newest accepted command echoes; None before the first (eq. 8)."""
        return None if self._echoed_s is None else now_s - self._echoed_s

    def permission(self, now_s: float) -> Permission:
        """What may reach the arm in this tick."""
        permission = self.safety.permission(now_s)
        if permission.command is not None and self._sent_s is not None:
            self.applied_age.add(now_s - self._sent_s)
        return permission

    def take_epoch_began(self) -> bool:
        """Whether another epoch began since the last call."""
        began, self._began = self._began, False
        return began

    def take_next_target(self) -> bool:
        """Whether the button for the next target was pressed since the last call."""
        pressed, self._next_target_pressed = self._next_target_pressed, False
        return pressed

    def take_answers(self) -> list[Answer]:
        """What to send besides stiffness."""
        answers, self._answers = self._answers, []
        return answers

    def _admits(self, message: AnyMessage, now_s: float) -> bool:
        """Whether a message of another epoch may begin it: a Hello, once the present operator has gone silent."""
        return isinstance(message, Hello) and now_s - self._heard_s > OPERATOR_SILENT_S

    def _begin_epoch(self, now_s: float) -> None:
        self.safety.new_epoch(now_s)
        self._began = True
        self._echoed_s = self._sent_s = None
        self._next_target_was_down = self._next_target_pressed = False

    def _answer_hello(self, peer: bytes, now_s: float) -> None:
        # Bounded, however fast strangers knock.
        if now_s - self._answered_s >= _ANSWER_PERIOD_S:
            self._answered_s = now_s
            self._answers.append(Answer(peer, encode(self.link.hello(now_s))))
