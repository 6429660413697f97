"""Operators that the robot side knows, and decisions on their messages."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from common.errors import OtherVersionError, RemoteProtocolError
from common.peer_name import key_part
from common.protocol.codec import decode
from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import Header, Hello, Mark, MotionCommand, Tune, Watch
from common.protocol.session import SessionEvent, SessionState
from common.silence import counted_s
from common.statistics import RunningStatistics
from robot_side.operators.announcements import Announcements, Answer
from robot_side.operators.episodes import Episodes
from robot_side.operators.lease import MOST_OBSERVERS, Lease, Participant
from robot_side.operators.safety import Permission, Safety
from robot_side.operators.tuning import Tuning
from robot_side.operators.watchers import Watchers


class Receiver(NamedTuple):
    """Peer that a stiffness message is for, and the header of that message."""

    peer: bytes
    header: Header
    everywhere: bool
    """Whether to send over every connection, because the state of the robot has changed"""


class OperatorSession:
    """One owner and its observers: admits peers, and judges the order and validity of their messages."""

    def __init__(
        self,
        new_link: Callable[[], LinkEnd],
        safety: Safety,
        seed: int = 0,
        tuning: Tuning | None = None,
        episodes: Episodes | None = None,
    ) -> None:
        """new_link: makes our end of the link to one more operator; all ends share our epoch."""
        self.safety = safety
        self.tuning = tuning or Tuning()
        self.episodes = episodes or Episodes()
        self.lease = Lease(safety)
        self.rejected = 0
        """Number of payloads that were no valid message, or came from a peer that was not admitted"""
        self.other_version = 0
        """Number of rejected payloads of another version of the protocol"""
        self.refused = 0
        """Number of refused requests to be admitted, because there was no room or the epoch had ended"""
        self.not_owners = 0
        """Number of commands that were not the owner's, or not under its present lease; none of them is applied"""
        self.motion_received = 0
        """Number of motion commands, of the owner and of others"""
        self.driving_delay = RunningStatistics(seed)
        """One-way delay, in seconds, of the owner's commands while the arm is armed"""
        self.applied_age = RunningStatistics(seed)
        """Age, in seconds, of the command that moves the arm, in every tick that has such a command"""
        self.leases_granted = 0
        self.watchers = Watchers()
        """Views that each operator watches"""
        self._new_link = new_link
        self._announcements = Announcements(new_link, self.lease, self.tuning)
        self._owner_link = new_link()
        self._token = 0
        self._updated_s = -math.inf
        self._began = False
        self._loop_age_s: float | None = None
        self._accepted_s = -math.inf
        self._sent_s: float | None = None
        self._next_target_pressed = False

    @property
    def link(self) -> LinkEnd:
        """Our end of the link to the owner; without an owner, of the link to the last owner"""
        return self._owner_link

    @property
    def owner_peer(self) -> bytes | None:
        """Connection of the owner; None while nobody owns the lease."""
        owner = self.lease.owner
        return None if owner is None else owner.peer

    @property
    def stale(self) -> int:
        """Number of messages of all operators that came too late to be applied"""
        return self.lease.stale + sum(one.link.stale for one in self.lease.known())

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take one control payload from `peer`; only a valid and timely message of the owner can move the arm."""
        self.update(now_s)
        try:
            message = decode(payload)
        except OtherVersionError as error:
            self.rejected += 1
            self.other_version += 1
            self._announcements.refuse(peer, SessionState.UNKNOWN, str(error), now_s)
            return
        except RemoteProtocolError:
            self.rejected += 1
            return
        from_robot = isinstance(message, Hello) and message.side == "robot"
        if from_robot or not isinstance(message, Hello | MotionCommand | Tune | Mark | Watch):
            self.rejected += 1
            return
        participant = self.lease.find(message.header.epoch) or self._admit(peer, message, now_s)
        if participant is None or key_part(participant.peer) != key_part(peer):
            # An epoch belongs to the key that began it, over any connection.
            self.rejected += 1
            return
        arrival = participant.link.arrived(message, now_s)
        if arrival.fresh:
            # Only a new message proves that an operator is there, and at which peer; a replay does not.
            participant.heard_s, participant.peer = now_s, peer
            if participant.state is SessionState.AWAY:
                self.lease.ask(participant, now_s)
                self._follow_owner()
        if isinstance(message, MotionCommand):
            self.motion_received += not arrival.copy
            driving = participant is self.lease.owner and self.safety.state == "armed" and not arrival.copy
            if driving and arrival.one_way_s is not None:
                self.driving_delay.add(arrival.one_way_s)
            self._judge(participant, message, arrival, now_s)
        elif arrival.fresh:
            self._follow(participant, message, now_s)

    def _follow(self, participant: Participant, message: Hello | Tune | Mark | Watch, now_s: float) -> None:
        """Process a message that is no motion command."""
        if isinstance(message, Watch):
            self.watchers.heard(participant.epoch, message, now_s)
        elif isinstance(message, Hello):
            self._announcements.answer(participant, now_s)
        elif isinstance(message, Mark):
            if message.number > participant.marked[0]:
                owns, armed = participant is self.lease.owner, self.safety.state == "armed"
                participant.marked = message.number, self.episodes.mark(message.kind, owns=owns, armed=armed)
        elif message.number > participant.tuned:
            participant.tuned = message.number
            granted = self.tuning.grant(message, now_s, owns=participant is self.lease.owner)
            if granted and message.link is not None:
                participant.link.expect_other_delay()

    def update(self, now_s: float) -> None:
        """Update the lease for participants that have been silent too long; to be called in every tick."""
        if now_s == self._updated_s:
            return  # once for all messages that arrive together
        self._updated_s = now_s
        self.tuning.begin(now_s)
        self.lease.expire(now_s)
        self._follow_owner()

    def owners(self, now_s: float) -> list[Receiver]:
        """Return the receiver of the owner's stiffness message; an empty list while nobody owns the lease."""
        owner = self.lease.owner
        return [] if owner is None else [self._receiver(owner, now_s)]

    def observers(self, now_s: float) -> list[Receiver]:
        """Return the receivers of the observers' stiffness messages."""
        return [self._receiver(one, now_s) for one in self.lease.observers()]

    def shown_header(self, now_s: float) -> Header:
        """Return a header for a message to viewers, which is made between ticks."""
        return self._announcements.stamp_shown(now_s)

    def loop_age_s(self, now_s: float) -> float | None:
        """Return the loop age (eq. 8): age of our stamp that the newest accepted command echoes; None before the first.

        Of a silence, the peer's or ours, only a part counts (common/silence.py).
        """
        if self._loop_age_s is None:
            return None
        return self._loop_age_s + counted_s(now_s - self._accepted_s, self._owner_link.turn_s)

    def permission(self, now_s: float) -> Permission:
        """Return the command that may reach the arm in this tick, if any."""
        permission = self.safety.permission(now_s)
        if permission.command is not None and self._sent_s is not None:
            self.applied_age.add(now_s - self._sent_s)
        return permission

    def take_owner_changed(self) -> bool:
        """Return whether an operator became the lease's owner since the last call."""
        began, self._began = self._began, False
        return began

    def take_next_target(self) -> bool:
        """Return whether the button for the next target was pressed since the last call."""
        pressed, self._next_target_pressed = self._next_target_pressed, False
        return pressed

    def take_answers(self, now_s: float) -> list[Answer]:
        """Return the messages to send besides stiffness."""
        return self._announcements.take(now_s)

    def summary(self) -> dict[str, Any]:
        """Return the counts of the lease, of refusals and of tuning."""
        return {
            "granted": self.leases_granted,
            "token": self.lease.token,
            "observers": len(self.lease.observers()),
            "refused": self.refused,
            "commands_of_non_owners": self.not_owners,
            "other_version": self.other_version,
            "discarded_by_age": self.safety.discarded_by_age,
            "tuning": self.tuning.summary(),
        }

    def _admit(
        self, peer: bytes, message: Hello | MotionCommand | Tune | Mark | Watch, now_s: float
    ) -> Participant | None:
        """Admit a new epoch, which only a Hello can begin; None if the epoch is refused."""
        epoch = message.header.epoch
        if self.lease.has_ended(epoch):
            self.refused += isinstance(message, Hello)
            self._announcements.refuse(
                peer, SessionState.ENDED, "this epoch of the operator side has ended; valid: a new epoch", now_s
            )
            return None
        if not isinstance(message, Hello):
            self._announcements.refuse(peer, SessionState.UNKNOWN, "no Hello yet", now_s)
            return None
        self.lease.end_epoch_of(peer, epoch, now_s)
        participant = Participant(epoch, peer, self._new_link(), now_s)
        if not self.lease.ask(participant, now_s):
            self.refused += 1
            why = f"{MOST_OBSERVERS} other operators observe already, which is the maximum"
            self._announcements.refuse(peer, SessionState.UNKNOWN, why, now_s)
            return None
        self._follow_owner()
        return participant

    def _judge(self, participant: Participant, command: MotionCommand, arrival: Arrival, now_s: float) -> None:
        if not self._may_command(participant, command):
            self.not_owners += 1
            participant.session.handle(SessionEvent.WRONG_TOKEN)
            if participant is self.lease.owner:
                # A stop of this owner counts under any lease token.
                self.safety.hear_stop(command, now_s)
            return
        if not self.safety.receive(command, arrival, now_s):
            return
        self._loop_age_s, self._accepted_s = arrival.loop_age_s, now_s
        # On our own clock, so that the age grows from tick to tick.
        self._sent_s = None if arrival.one_way_s is None else now_s - arrival.one_way_s
        self._next_target_pressed |= command.next_target and not participant.next_target_was_down
        participant.next_target_was_down = command.next_target
        handing_over = command.hand_over and not participant.hand_over_was_down
        participant.hand_over_was_down = command.hand_over
        if handing_over and self.lease.hand_over(now_s):
            self._follow_owner()

    def _may_command(self, participant: Participant, command: MotionCommand) -> bool:
        return participant is self.lease.owner and command.token == self.lease.token

    def _follow_owner(self) -> None:
        """Forget the last owner's commands as soon as the lease has another token."""
        owner = self.lease.owner
        if owner is None or self.lease.token == self._token:
            return
        self._token = self.lease.token
        self._owner_link = owner.link
        # A button that was held before the lease began does not count as pressed.
        owner.hand_over_was_down = owner.next_target_was_down = True
        self.leases_granted += 1
        self._began = True
        self._loop_age_s = self._sent_s = None
        self._next_target_pressed = False

    def _receiver(self, participant: Participant, now_s: float) -> Receiver:
        state = self.safety.state
        header, changed = self._announcements.stamp(now_s, participant.link), state != participant.told_state
        participant.told_state = state
        return Receiver(participant.peer, header, changed)
