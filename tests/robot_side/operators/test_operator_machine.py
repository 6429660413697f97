"""Lease, safety and session after random actions of operators, compared step by step with a second implementation."""

from dataclasses import replace
from itertools import pairwise
from typing import Any
from unittest.mock import patch

import pytest
from hypothesis import Phase
from hypothesis import settings as how
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from common.peer_name import peer_name
from common.protocol.codec import encode
from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import AnyMessage, Header, Hello, MotionCommand
from common.protocol.session import OWNING
from robot_side.operators import lease as lease_module
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import RELEASED_TRAVEL, Safety, SafetySettings
from tests.robot_side.operators.reference_operators import ROOM, ReferenceOperators

PERIOD_S = 0.004
SETTINGS = SafetySettings(max_delay_s=0.5, healthy_s=0.05, lease_s=0.4)
FRESH = Arrival(fresh=True, queueing_age_s=0.0, one_way_s=0.01, loop_age_s=0.02)

epochs = st.integers(1, 5)
triggers = st.sampled_from(
    [(0.0, 0.0)] * 4 + [(RELEASED_TRAVEL, RELEASED_TRAVEL), (0.021, 0.0), (0.0, 0.021), (1.0, 1.0)]
)
rarely = st.sampled_from([False, False, False, True])


def mostly(rests: Any, *held: Any) -> st.SearchStrategy[Any]:
    return st.sampled_from([rests] * 8 + list(held))


arrivals = st.builds(
    Arrival,
    fresh=st.just(value=True),
    queueing_age_s=st.sampled_from([0.0, 0.0, 0.18, 0.181, 1.0]),
    one_way_s=st.just(0.01),
    loop_age_s=st.sampled_from([0.02, 0.02, 0.1, 0.499, 0.501, None]),
)


class DrawnLink(LinkEnd):
    """End of a link that recognizes fresh messages as the real one does; the state machine draws the ages."""

    ages = FRESH

    def arrived(self, message: AnyMessage, now_s: float) -> Arrival:
        return replace(DrawnLink.ages, fresh=super().arrived(message, now_s).fresh)


class OperatorMachine(RuleBasedStateMachine):
    """State machine of operators that come, go, command and replay messages.

    After each step, the product is compared with the reference, and invariants are checked.
    """

    def __init__(self) -> None:
        super().__init__()
        self.patches = [patch.object(lease_module, name, ROOM) for name in ("MOST_OBSERVERS", "MOST_AWAY")]
        for each in self.patches:
            each.start()
        self.now_s, self.sequence, self.epoch, self.armed = 10.0, 0, 5, False
        self.sent: list[Hello | MotionCommand] = []
        self.accepted: list[tuple[float, MotionCommand]] = []
        self.tokens = [0]

    @initialize(healthy_s=st.sampled_from([0.05, 0.05, 0.0]))
    def begin(self, healthy_s: float) -> None:
        settings = replace(SETTINGS, healthy_s=healthy_s)
        self.safety, self.reference = Safety(settings), ReferenceOperators(settings)
        self.session = OperatorSession(lambda: DrawnLink("robot", 99, "clock"), self.safety)
        self.hello(1)

    def teardown(self) -> None:
        for each in self.patches:
            each.stop()

    @rule(epoch=epochs)
    def hello(self, epoch: int, peer: bytes | None = None) -> None:
        hello = Hello(self.header(epoch), side="operator", clock_domain="clock")
        self.deliver(hello, peer or peer_name("", b"%d" % epoch))

    @rule(place=st.integers(0, 20))
    def restart(self, place: int) -> None:
        """Begin a new epoch over a participant's connection, which ends that participant's epoch for ever."""
        if place < len(self.reference.parties):
            self.epoch += 1
            self.hello(self.epoch, list(self.reference.parties.values())[place].peer)

    @rule(
        arrival=arrivals,
        whose=st.sampled_from(["owner", "owner", "owner", "owner", "observer", "anybody"]),
        epoch=epochs,
        behind=st.sampled_from([0, 0, 0, 1]),
        content=st.fixed_dictionaries(
            {"run": st.booleans(), "arm": st.booleans()}
            | dict.fromkeys(("emergency_stop", "hand_over", "next_target"), rarely)
            | {"home": mostly(0.0, 0.5), "gripper": mostly(0.0, -1.0)}
            | dict.fromkeys(("lateral", "turning"), mostly((0.0, 0.0), (0.0, -0.02), (0.021, 0.0), (0.0, -1.0)))
        ),
        travels=triggers,
    )
    def command(
        self,
        arrival: Arrival,
        whose: str,
        epoch: int,
        behind: int,
        content: dict[str, Any],
        travels: tuple[float, float],
    ) -> None:
        """Send one command. behind: 0 for the token of the present lease, 1 for a token that is one less."""
        waiting = self.reference.observers()
        if whose == "owner" and self.reference.owner is not None:
            epoch = self.reference.owner.epoch
        elif whose == "observer" and waiting:
            epoch = waiting[0].epoch
        self.say(epoch, arrival, travels, token=max(0, self.reference.token - behind), **content)

    @rule(place=st.integers(0, 30), key=st.sampled_from(["", "another"]))
    def replay(self, place: int, key: str) -> None:
        """Deliver an earlier message again, over another connection with the same key or another key."""
        self.deliver(self.sent[max(0, len(self.sent) - 1 - place)], peer_name(key, b"elsewhere"))

    @rule(epoch=epochs, stop=st.booleans())
    def forge(self, epoch: int, *, stop: bool) -> None:
        """Send a command with an operator's epoch, but over a connection with another key."""
        forged = MotionCommand(self.header(epoch), 1.0, 0.0, run=True, emergency_stop=stop, token=self.reference.token)
        self.deliver(forged, peer_name("another", b"forger"))

    @rule(duration_s=st.sampled_from([0.001, 0.03, 0.099, 0.101, 0.3, 0.41, 0.6]), ticks=st.integers(0, 3))
    def silence(self, duration_s: float, ticks: int) -> None:
        """Let `duration_s` pass, with `ticks` ticks. With none, the session notices only by the next message."""
        for _ in range(ticks):
            self.tick(duration_s / ticks)
        self.now_s += 0.0 if ticks else duration_s

    @rule()
    def come_back(self) -> None:
        """Let all participants be silent until their leases end, then let them come back one after the other."""
        self.tick(SETTINGS.lease_s)
        for epoch, party in list(self.reference.parties.items()):
            self.hello(epoch, party.peer)

    @rule(
        count=st.integers(1, 30),
        travels=triggers,
        content=st.fixed_dictionaries(
            {"arm": st.booleans()} | dict.fromkeys(("emergency_stop", "hand_over", "next_target"), rarely)
        ),
        echo=st.booleans(),
    )
    def stream(self, count: int, travels: tuple[float, float], content: dict[str, bool], *, echo: bool) -> None:
        """Send `count` commands of the owner, a tick after each; then waiting participants send a Hello."""
        for _ in range(count):
            if (owner := self.reference.owner) is not None:
                ages = FRESH if echo else replace(FRESH, loop_age_s=None)
                self.say(owner.epoch, ages, travels, token=self.reference.token, run=True, **content)
            self.tick(PERIOD_S)
        for party in self.reference.observers():
            self.hello(party.epoch, party.peer)

    @rule(
        count=st.sampled_from([12, 13, 14, 20]),
        pause_s=st.sampled_from([0.0, 0.0, 0.099, 0.101, 0.3]),
        ticks=st.integers(0, 2),
    )
    def arm(self, count: int, pause_s: float, ticks: int) -> None:
        """Try to arm: send commands with released triggers for about the healthy time, pause, and press the button."""
        self.stream(count, (0.0, 0.0), {}, echo=True)
        self.silence(pause_s, ticks)
        self.stream(1, (0.0, 0.0), {"arm": True}, echo=True)

    def header(self, epoch: int) -> Header:
        self.sequence += 1
        return Header(epoch, self.sequence, self.now_s)

    def say(self, epoch: int, arrival: Arrival, travels: tuple[float, float], **content: Any) -> None:
        party = self.reference.parties.get(epoch)
        peer = peer_name("", b"nobody") if party is None else party.peer
        self.deliver(MotionCommand(self.header(epoch), *travels, **content), peer, arrival)

    def deliver(self, message: Hello | MotionCommand, peer: bytes, arrival: Arrival = FRESH) -> None:
        self.sent.append(message)
        DrawnLink.ages = arrival
        before = self.safety.command
        self.session.receive(peer, encode(message), self.now_s)
        self.reference.hear(message, peer, arrival, self.now_s)
        if (command := self.safety.command) is not None and command is not before:
            self.accepted.append((self.now_s, command))
        self.compare()

    def tick(self, duration_s: float) -> None:
        """Advance time, and do for session and reference what the core does in a tick; compare the results."""
        self.now_s += duration_s
        self.session.update(self.now_s)
        self.reference.update(self.now_s)
        self.reference.check(self.now_s)
        permission = self.session.permission(self.now_s)
        owner, command = self.reference.owner, self.reference.command
        moving = owner is not None and command is not None and permission.state == "armed" and command.run
        assert permission.command == (command if moving else None)
        if permission.command is not None:
            assert self.reference.accepted_s is not None
            assert permission.valid_until_s == self.reference.accepted_s + SETTINGS.gap_s
            assert self.now_s <= permission.valid_until_s
        assert self.session.take_owner_changed() == self.reference.owner_changed
        assert self.session.take_next_target() == self.reference.next_target
        self.reference.owner_changed = self.reference.next_target = False
        self.compare()

    def compare(self) -> None:
        session, reference = self.session, self.reference
        owner = session.lease.owner
        assert (None if owner is None else owner.epoch) == (None if not reference.owner else reference.owner.epoch)
        assert {one.epoch: one.state for one in session.lease.known()} == {
            epoch: party.state for epoch, party in reference.parties.items()
        }
        assert [one.epoch for one in session.lease.observers()] == [one.epoch for one in reference.observers()]
        assert {one.peer for one in session.lease.known()} == {one.peer for one in reference.parties.values()}
        armed = reference.owner is not None and reference.owner.state == "armed"
        assert session.safety.state == ("armed" if armed else "stopped" if reference.stopped else "disarmed")
        assert session.safety.command == reference.command
        assert len(session.safety.stops) == len(reference.stops)
        for (when_s, why), (expected_s, beginning) in zip(session.safety.stops, reference.stops, strict=True):
            assert when_s == expected_s
            assert why.startswith(beginning)
        loop_age_s = session.loop_age_s(self.now_s)
        if reference.loop_began_s is None:
            assert loop_age_s is None
        else:
            # Of the time since the command came, no more than 4 of its first 20 ms.
            silent_s = self.now_s - reference.loop_heard_s
            age_s = reference.loop_heard_s - reference.loop_began_s + max(min(silent_s, 0.004), silent_s - 0.016)
            assert loop_age_s == pytest.approx(age_s, abs=1e-9)
        for name in ("granted", "token", "refused"):
            assert session.summary()[name] == getattr(reference, name)
        assert session.summary()["commands_of_non_owners"] == reference.not_owners
        assert session.summary()["discarded_by_age"] == reference.discarded
        assert session.rejected == reference.rejected
        self.hold_what_must_always_hold()

    def hold_what_must_always_hold(self) -> None:
        """Assert the invariants: one owner, growing tokens, no older command accepted, and correct arming."""
        lease, command = self.session.lease, self.safety.command
        owning = [one for one in lease.known() if one.state in OWNING]
        assert owning == ([] if lease.owner is None else [lease.owner])
        if lease.token != self.tokens[-1]:
            self.tokens.append(lease.token)
            assert self.tokens[-2] < self.tokens[-1]
        if command is not None:
            assert lease.owner is not None
            assert (command.header.epoch, command.token) == (lease.owner.epoch, lease.token)
        of_owner = [(when_s, one) for when_s, one in self.accepted[-100:] if one.token == lease.token]
        assert all(one.header.sequence < other.header.sequence for (_, one), (_, other) in pairwise(of_owner))
        armed = self.safety.state == "armed"
        if armed and not self.armed:
            began_s = self.now_s - self.safety.settings.healthy_s + 1e-9
            earlier = [place for place, (when_s, _) in enumerate(of_owner) if when_s <= began_s]
            healthy = of_owner[earlier[-1] :]
            assert all(max(one.l2, one.r2) <= RELEASED_TRAVEL and not one.emergency_stop for _, one in healthy)
            assert all(later - earlier <= SETTINGS.gap_s for (earlier, _), (later, _) in pairwise(healthy))
            assert [one.arm for _, one in of_owner[-2:]] == [False, True]
        self.armed = armed


TestOperators = OperatorMachine.TestCase
TestOperators.settings = how(
    derandomize=True, deadline=None, max_examples=120, stateful_step_count=50, phases=(Phase.explicit, Phase.generate)
)
