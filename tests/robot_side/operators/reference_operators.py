"""Second implementation of lease, session and safety, with which the state machine compares the product's."""

from dataclasses import dataclass, field

from common.protocol.link_end import Arrival
from common.protocol.messages import Hello, MotionCommand
from common.protocol.session import SessionState
from robot_side.operators.safety import RELEASED_TRAVEL, SafetySettings

State = SessionState
ROOM = 2
"""Maximum number of observers, and of operators that are away; the state machine gives the product the same limits"""


@dataclass(eq=False)
class Party:
    """What is known about one epoch of an operator."""

    epoch: int
    peer: bytes
    heard_s: float
    waiting_s: float
    state: State = State.UNKNOWN
    hand_over_down: bool = True
    next_target_down: bool = True
    newest: dict[type, int] = field(default_factory=dict)


class ReferenceOperators:
    """Lease, safety and session of all operators, in one class with simple variables."""

    def __init__(self, settings: SafetySettings) -> None:
        self.settings = settings
        self.parties: dict[int, Party] = {}
        self.owner: Party | None = None
        self.ended: set[int] = set()
        self.token = self.settled_token = self.granted = self.rejected = self.refused = self.not_owners = (
            self.discarded
        ) = 0
        self.stops: list[tuple[float, str]] = []
        """Each stop of the arm: (time, first words of the reason)"""
        self.stopped = self.next_target = self.owner_changed = False
        self.followed: dict[int, int] = {}
        """Sequence number of the newest emergency stop that was followed, by epoch"""
        self.loop_began_s: float | None = None
        self.loop_heard_s = 0.0
        """Time at which the newest command was accepted"""
        self._listen()

    def _listen(self) -> None:
        """Forget all commands, as earlier ones do not count in a new lease."""
        self.command: MotionCommand | None = None
        self.accepted_s: float | None = None
        self.echo_s: float | None = None
        self.quiet_s: float | None = None
        self.arm_down = True

    def update(self, now_s: float) -> None:
        for party in list(self.parties.values()):
            if party.state is not State.AWAY and now_s - party.heard_s >= self.settings.lease_s:
                self._leave(party, State.AWAY, now_s)
        away = sorted((one for one in self.parties.values() if one.state is State.AWAY), key=lambda one: one.heard_s)
        if len(self.parties) > ROOM:
            for party in away[: max(0, len(away) - ROOM)]:
                self._forget(party, now_s)
        self._settle()

    def check(self, now_s: float) -> None:
        """Disarm the arm after a gap in the commands, or if the loop age is too high or unknown."""
        if self.accepted_s is not None and now_s - self.accepted_s > self.settings.gap_s:
            self._disarm(now_s, f"no command for {1e3 * (now_s - self.accepted_s):.0f} ms")
            self.command = self.accepted_s = None
        if not self._loop_is_young(now_s):
            self._disarm(now_s, "the link's round trip takes")

    def hear(self, message: Hello | MotionCommand, peer: bytes, arrival: Arrival, now_s: float) -> None:
        """Receive one message. `arrival` gives its ages; whether it is fresh is computed here."""
        self.update(now_s)
        self._hear(message, peer, arrival, now_s)
        self._settle()

    def _hear(self, message: Hello | MotionCommand, peer: bytes, arrival: Arrival, now_s: float) -> None:
        epoch, sequence = message.header.epoch, message.header.sequence
        party = self.parties.get(epoch) or self._admit(message, peer, now_s)
        if party is None or party.peer[:16] != peer[:16]:
            self.rejected += 1
            return
        fresh = sequence > party.newest.get(type(message), 0)
        if fresh:
            party.newest[type(message)] = sequence
            party.heard_s, party.peer = now_s, peer
            if party.state is State.AWAY:
                self._ask(party, now_s)
        if not isinstance(message, MotionCommand):
            return
        if party is not self.owner or message.token != self.token:
            self.not_owners += 1
            if party is self.owner:
                self._hear_stop(message, now_s)
            return
        self._hear_stop(message, now_s)
        if fresh and arrival.queueing_age_s > self.settings.age_s + self.settings.jitter_s:
            self.discarded += 1
        elif fresh:
            self._accept(party, message, arrival.loop_age_s, now_s)

    def _accept(self, owner: Party, command: MotionCommand, loop_age_s: float | None, now_s: float) -> None:
        self.check(now_s)
        self.command, self.accepted_s = command, now_s
        self.loop_began_s, self.loop_heard_s = None if loop_age_s is None else now_s - loop_age_s, now_s
        if self.loop_began_s is not None:
            self.echo_s = self.loop_began_s
        pressed, self.arm_down = command.arm and not self.arm_down, command.arm
        inputs = command.l2, command.r2, *command.lateral, *command.turning
        released = not (command.gripper or command.home) and all(abs(one) <= RELEASED_TRAVEL for one in inputs)
        if not self._loop_is_young(now_s) or not (released or owner.state is State.ARMED):
            self._disarm(now_s, "the link's round trip takes")
        elif command.emergency_stop:
            self.quiet_s = None
        elif owner.state is not State.ARMED:
            self.quiet_s = now_s if self.quiet_s is None else self.quiet_s
            if now_s - self.quiet_s >= self.settings.healthy_s:
                owner.state = State.STOPPED_READY if self.stopped else State.READY
                if pressed:
                    owner.state, self.stopped = State.ARMED, False
        self.next_target |= command.next_target and not owner.next_target_down
        handing_over = command.hand_over and not owner.hand_over_down
        owner.next_target_down, owner.hand_over_down = command.next_target, command.hand_over
        if handing_over and self.observers():
            owner.waiting_s = now_s
            self._leave(owner, State.OBSERVING, now_s)

    def observers(self) -> list[Party]:
        waiting = [one for one in self.parties.values() if one.state is State.OBSERVING]
        return sorted(waiting, key=lambda one: one.waiting_s)

    def _loop_is_young(self, now_s: float) -> bool:
        return self.echo_s is not None and now_s - self.echo_s <= self.settings.max_delay_s

    def _disarm(self, now_s: float, why: str) -> None:
        self.quiet_s = None
        if self.owner is not None:
            if self.owner.state is State.ARMED:
                self.stops.append((now_s, why))
            self.owner.state = State.STOPPED if self.stopped else State.DISARMED

    def _hear_stop(self, command: MotionCommand, now_s: float) -> None:
        """Follow an emergency stop however late it comes, unless this one or a newer one was followed already."""
        epoch, sequence = command.header.epoch, command.header.sequence
        if command.emergency_stop and sequence > self.followed.get(epoch, 0):
            self.followed = {epoch: sequence}
            self._stop(now_s)

    def _stop(self, now_s: float) -> None:
        if self.owner is not None and self.owner.state is not State.STOPPED:
            self.stops.append((now_s, "emergency stop"))
            self.stopped, self.quiet_s, self.owner.state = True, None, State.STOPPED

    def _admit(self, message: Hello | MotionCommand, peer: bytes, now_s: float) -> Party | None:
        epoch = message.header.epoch
        if epoch in self.ended or not isinstance(message, Hello):
            self.refused += isinstance(message, Hello)
            return None
        for other in [one for one in self.parties.values() if one.peer == peer]:
            self._forget(other, now_s)
        party = Party(epoch, peer, now_s, now_s)
        self._ask(party, now_s)
        if party.state is State.UNKNOWN:
            self.refused += 1
            return None
        self.parties[epoch] = party
        return party

    def _ask(self, party: Party, now_s: float) -> None:
        if self.owner is None:
            self._grant(party, now_s)
        elif len(self.observers()) < ROOM:
            party.state, party.waiting_s = State.OBSERVING, now_s

    def _grant(self, party: Party, now_s: float) -> None:
        self.token = max(self.token + 1, int(1e3 * now_s))
        self.owner = party
        party.state = State.STOPPED if self.stopped else State.DISARMED
        self._listen()

    def _settle(self) -> None:
        """Grant the lease by the final state after a message: an owner that lost the lease again does not count."""
        if self.owner is not None and self.token != self.settled_token:
            self.settled_token = self.token
            self.granted += 1
            self.owner_changed, self.next_target, self.loop_began_s = True, False, None
            self.owner.hand_over_down = self.owner.next_target_down = True

    def _leave(self, party: Party, state: State, now_s: float) -> None:
        """Give `party` a state without the lease.

        If it had the lease, the lease passes to the participant who has waited longest, of those heard lately.
        """
        waiting = [one for one in self.observers() if now_s - one.heard_s < self.settings.lease_s]
        if party.state is State.ARMED:
            self.stops.append((now_s, ""))
        party.state = state
        if party is self.owner:
            self.owner = None
            self._listen()
            if waiting:
                self._grant(waiting[0], now_s)

    def _forget(self, party: Party, now_s: float) -> None:
        self._leave(party, State.ENDED, now_s)
        self.ended.add(party.epoch)
        del self.parties[party.epoch]
