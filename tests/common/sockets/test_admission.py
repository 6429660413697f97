"""Which messages and connections the robot side's port admits.

A state machine lets peers send, flood, leave and be revoked; other tests check the limits for many connections.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import zmq
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule

from common.peer_name import peer_name
from common.sockets import robot as robot_sockets
from common.sockets.allow_list import AllowList
from common.sockets.door.admission import AT_ONCE_S, EACH_OTHER_PER_S, OTHERS_PER_S, Admission
from common.sockets.keys import KeyFolder
from common.sockets.port_connections import PortConnections
from common.sockets.robot import RobotSockets
from common.sockets.round_robin import SILENCE_S, Offered, group_of, routing_id
from tests.helpers.socket_talk import EPHEMERAL

LIMIT = 8
"""Limit of messages that one key may send in a second, in these tests; low, so that floods are short"""
KEYS = ("anna's", "ben's")
GROUP = b"\x01" + b"a group of ours"
"""Group of connections, as `new_group` makes them, but always the same, so that each run has the same order"""
NAMES = (routing_id(GROUP, 0), routing_id(GROUP, 1), b"raw")
DESCRIPTORS = (10_000, 10_001, 10_002)


@dataclass(eq=False)
class Line:
    name: bytes
    key: str
    descriptor: int
    heard_s: float = 0.0
    seen: bool = False
    """Whether one of this connection's messages was read at a time when the gates had reported all events"""
    by_another: bool = True
    """Whether this connection's descriptor differs from that of the connection heard before with the same routing id"""
    known: bool = False
    """Whether the robot side, when the gates had reported all events, could distinguish these two connections"""

    @property
    def peer(self) -> bytes:
        return peer_name(self.key, group_of(self.name))


class Connections(RuleBasedStateMachine):
    """State machine of peers that connect, send, flood, leave and are revoked.

    A message may be read long after its sender left. A new connection takes over a routing id in use, even with
    another key. unseen: ZeroMQ's events that the gates have not received yet; while `late` is true they receive none.
    """

    def __init__(self) -> None:
        super().__init__()
        self.list = AllowList(KeyFolder(Path("nowhere")), roles=dict.fromkeys(KEYS, "operator"))
        self.allowed = self.list.roles
        self.second = 0
        self.open: dict[int, Line] = {}
        self.newest: dict[bytes, Line] = {}
        self.heard: dict[bytes, Line] = {}
        self.unseen: list[tuple[str, int]] = []
        self.late = False
        self.spoken: Counter[tuple[str, int]] = Counter()
        self.ended: list[int] = []
        self.told: list[bytes] = []
        self.arriving: list[Any] = []
        self.patch = pytest.MonkeyPatch()
        self.robot = RobotSockets(EPHEMERAL)
        for name, stand_in in (
            ("_clock", SimpleNamespace(now=lambda: float(self.second))),
            ("_keys", SimpleNamespace(allowed=self.list)),
            ("_watch_connections", self.watch),
            ("offer", self.take),
        ):
            self.patch.setattr(self.robot, name, stand_in)
        self.patch.setattr(self.robot._inbox, "read", lambda: self.arriving)
        self.patch.setattr(robot_sockets, "shut_down", self.ended.append)
        self.patch.setattr(robot_sockets, "PEER_LIMIT_PER_S", LIMIT)

    def teardown(self) -> None:
        self.patch.undo()
        self.robot.close()

    def take(self, _: object, name: bytes, payload: bytes) -> Offered:
        if payload == b"stiffness":
            self.told.append(name)
        return Offered.TAKEN if self.is_open(self.newest[name]) or payload else Offered.GONE

    def watch(self) -> None:
        crowd = self.robot._ports.gates[0].connections
        while self.unseen and not self.late:
            event, descriptor = self.unseen.pop(0)
            crowd.accepted(descriptor, float(self.second)) if event == "came" else crowd.ended(descriptor)
        self.robot._ports.all_seen = not self.unseen

    def leave(self, descriptor: int) -> None:
        del self.open[descriptor]
        self.unseen.append(("went", descriptor))

    @rule(
        descriptor=st.sampled_from(DESCRIPTORS),
        name=st.sampled_from(NAMES),
        key=st.sampled_from(KEYS),
        comes=st.booleans(),
    )
    def leave_or_come(self, descriptor: int, name: bytes, key: str, comes: bool) -> None:
        """End the connection that has this descriptor; with `comes`, a new connection has the descriptor at once."""
        if descriptor in self.open:
            self.leave(descriptor)
        if comes:
            self.open[descriptor] = self.newest[name] = Line(name, key, descriptor)
            self.unseen.append(("came", descriptor))

    @rule(key=st.sampled_from(KEYS))
    def allow_or_revoke(self, key: str) -> None:
        if self.allowed.pop(key, None) is None:
            self.allowed[key] = "operator"

    @rule()
    def a_second_passes(self) -> None:
        self.second += 1

    def speakers(self) -> list[Line]:
        """Return the connections whose messages may be read now: of each routing id the newest one.

        It is open, or it was closed after a message of it had been read.
        """
        return [line for line in self.newest.values() if self.is_open(line) or line.seen]

    def is_open(self, line: Line) -> bool:
        return self.open.get(line.descriptor) is line

    @precondition(lambda self: self.speakers())
    @rule(data=st.data(), count=st.sampled_from([LIMIT + 1, 3, 1]), late=st.booleans())
    def speak(self, data: st.DataObject, count: int, late: bool) -> None:
        """Read `count` messages of one connection; check which are admitted and which connections are ended."""
        self.late = late
        line = data.draw(st.sampled_from(self.speakers()))
        properties = {"User-Id": line.key, int(zmq.SRCFD): line.descriptor}
        frame = SimpleNamespace(get=properties.__getitem__, bytes=b"payload")
        self.arriving = [[SimpleNamespace(bytes=line.name), frame]] * count
        self.ended.clear()
        received = self.robot.receive()
        spoken = self.spoken[line.key, self.second]
        admitted = min(count, max(0, LIMIT - spoken)) if line.key in self.allowed else 0
        assert received == [(line.peer, b"payload")] * admitted
        self.spoken[line.key, self.second] += count
        before, self.heard[line.name] = self.heard.get(line.name, line), line
        line.seen |= self.robot._ports.all_seen
        # A peer back on the same descriptor cannot be told from a sender that left messages, until they are too many.
        line.by_another &= before is line or before.descriptor != line.descriptor
        line.known |= self.robot._ports.all_seen and line.by_another
        line.heard_s = float(self.second) if admitted else before.heard_s if before.key == line.key else 0.0
        taken_over = {each.descriptor for each in self.open.values() if each.name == line.name and each is not line}
        of_peer = {each.descriptor for each in self.open.values() if each.peer == line.peer}
        assert set(self.ended) <= taken_over | (of_peer if admitted < count else set()), "somebody else's was ended"
        if self.robot._ports.all_seen:
            known = {each.descriptor for each in (*self.heard.values(), before) if each.known and self.is_open(each)}
            own = {line.descriptor} if self.is_open(line) else set()
            assert before is line or known & taken_over <= set(self.ended)
            assert admitted == count or own | (known & of_peer) <= set(self.ended), "who floods or was revoked stays"
        for descriptor in sorted(set(self.ended)):
            self.leave(descriptor)
        for name in sorted({line.peer, *(peer_name(key, group_of(name)) for name in NAMES for key in KEYS), b"nobody"}):
            self.tell(name)

    def tell(self, peer: bytes) -> None:
        """Send to a peer, over all its routing ids or the next one; check that these, and no others, are used.

        A routing id that has been silent for longer may get a copy.
        """
        lines = [line for line in self.heard.values() if line.peer == peer and line.key in self.allowed]
        everywhere = {line.name for line in lines}
        newest_s = max((line.heard_s for line in lines), default=0.0)
        in_turn = {line.name for line in lines if line.heard_s >= newest_s - SILENCE_S}
        for is_everywhere, rounds, names in ((True, 1, everywhere), (False, len(in_turn) or 1, in_turn)):
            self.told.clear()
            dropped = self.robot.dropped
            for _ in range(rounds):
                assert self.robot.send(peer, b"stiffness", everywhere=is_everywhere) == bool(names)
            copies = [name for name in self.told if name not in names]
            assert sorted(self.told) == sorted([*names, *copies])
            assert set(copies) <= everywhere
            assert len(copies) == len(set(copies))
            assert self.robot.dropped == dropped + (not names)


TestConnections = Connections.TestCase
# Without hypothesis' shrinking of failures, which would open thousands of sockets.
TestConnections.settings = settings(max_examples=200, stateful_step_count=30, phases=[Phase.explicit, Phase.generate])


def test_a_flooding_stranger_takes_nothing_from_the_operator_or_from_other_strangers() -> None:
    def seen(
        admission: Admission, *peers: bytes, operator: bytes | None = b"operator", now_s: float = 7.0
    ) -> list[bytes]:
        return [peer for peer, _ in admission.admitted([(peer, b"") for peer in peers], operator, now_s)]

    admission, flood = Admission(), [b"flood"] * 1000
    few = flood[: round(AT_ONCE_S * EACH_OTHER_PER_S)]
    assert seen(admission, *flood, b"observer", b"operator", *flood, b"operator") == [
        *(*few, b"observer", b"operator", b"operator")
    ]
    assert admission.unread == 2000 - len(few)
    assert seen(Admission(), *flood, operator=None) == few
    crowd = [b"%d" % number for number in range(100)]
    for now_s in (8.0, 9.0, 10.0):
        assert len(seen(admission, *crowd, now_s=now_s)) == round(AT_ONCE_S * OTHERS_PER_S)
        assert seen(admission, *crowd, now_s=now_s) == [], "however often one receives at that time"


@pytest.mark.parametrize("turn_s", [0.001, 0.004, 0.02])
def test_eight_observers_are_heard_whatever_the_period_of_turns_and_a_flood_is_cut(turn_s: float) -> None:
    admission, observers, heard = Admission(), [b"%d" % number for number in range(8)], 0
    turns = round(1.0 / turn_s)
    for turn in range(turns):
        arrived = [
            (peer, b"")
            for peer in observers
            for _ in range(round(250 * turn_s * (turn + 1)) - round(250 * turn_s * turn))
        ]
        heard += len(list(admission.admitted(arrived, b"operator", turn * turn_s)))
    assert (heard, admission.unread) == (8 * 250, 0)
    flooded = [
        len(list(admission.admitted([(b"flood", b"")] * 100, b"operator", 1.0 + turn * turn_s)))
        for turn in range(turns)
    ]
    assert sum(flooded) <= EACH_OTHER_PER_S * (1.0 + AT_ONCE_S)


def test_a_crowd_loses_its_oldest_newcomer_and_keeps_introduced_peers() -> None:
    crowd = PortConnections(limit=3, introduced_s=2.0)
    for descriptor in (0, 1, 2):
        crowd.accepted(descriptor, 0.0)
    assert list(crowd.surplus(0.0)) == []
    crowd.introduced(1)
    crowd.accepted(10, 1.9)
    assert (list(crowd.surplus(1.9)), crowd.hung_up) == ([0], 1)
    crowd.accepted(11, 2.1)
    assert list(crowd.surplus(2.1)) == [2], "it has said nothing for too long"
    crowd.introduced(11)
    crowd.accepted(12, 2.2)
    assert list(crowd.surplus(2.2)) == [10], "the oldest newcomer, as all the others are in"
    crowd.ended(1)
    crowd.accepted(1, 2.3)
    crowd.accepted(13, 2.4)
    assert list(crowd.surplus(2.4)) == [12]
    crowd.ended(99)
    crowd.introduced(99)
    assert list(crowd.surplus(2.4)) == []
