"""Peers that speak, flood, leave and are revoked: a state machine over the robot side's end, and a crowd's limits."""

from collections import Counter
from types import SimpleNamespace
from typing import Any

import pytest
import zmq
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule

from common.sockets import robot as robot_sockets
from common.sockets.admission import EACH_OTHER_PER_TICK, OTHERS_PER_TICK, Admission
from common.sockets.crowd import Crowd
from common.sockets.robot import RobotSockets
from tests.helpers.socket_talk import EPHEMERAL

LIMIT = 8
"""Messages of a peer in a second, in the machine, so that floods are short."""
KEYS = ("anna's", "ben's")
DESCRIPTORS = (10_000, 10_001)


class Connections(RuleBasedStateMachine):
    """Peers that come, speak, flood, leave and are revoked; a message may be read long after its sender left.

    `unseen` is what ZeroMQ has told and the gates have not heard yet; when they are `late` they hear nothing.
    """

    def __init__(self) -> None:
        super().__init__()
        self.allowed = dict.fromkeys(KEYS, "")
        self.second = 0
        self.owners: dict[int, bytes] = {}
        self.peers: dict[bytes, tuple[str, int]] = {}
        self.unseen: list[tuple[str, int]] = []
        self.late = False
        self.spoken: Counter[tuple[bytes, int]] = Counter()
        self.heard: set[bytes] = set()
        self.ended: list[int] = []
        self.told: list[bytes] = []
        self.arriving: list[Any] = []
        self.patch = pytest.MonkeyPatch()
        self.robot = RobotSockets(EPHEMERAL)
        for name, stand_in in (
            ("_clock", SimpleNamespace(now=lambda: float(self.second))),
            ("_keys", SimpleNamespace(allowed=SimpleNamespace(names=self.allowed))),
            ("_watch_connections", self.watch),
            ("send_frames", self.take),
        ):
            self.patch.setattr(self.robot, name, stand_in)
        self.patch.setattr(self.robot._inbox, "read", lambda: self.arriving)
        self.patch.setattr(robot_sockets, "_shut_down", self.ended.append)
        self.patch.setattr(robot_sockets, "PEER_LIMIT_PER_S", LIMIT)

    def teardown(self) -> None:
        self.patch.undo()
        self.robot.close()

    def take(self, _: object, frames: list[bytes], limit_bytes: int) -> bool:
        self.told.append(frames[0])
        return limit_bytes > 0

    def watch(self) -> None:
        crowd = self.robot._gates[0].crowd
        while self.unseen and not self.late:
            event, descriptor = self.unseen.pop(0)
            crowd.came(descriptor, float(self.second)) if event == "came" else crowd.went(descriptor)
        self.robot._all_seen = not self.unseen

    def leave(self, descriptor: int) -> None:
        del self.owners[descriptor]
        self.unseen.append(("went", descriptor))

    @rule(descriptor=st.sampled_from(DESCRIPTORS), key=st.sampled_from(KEYS), comes=st.booleans())
    def leave_or_come(self, descriptor: int, key: str, comes: bool) -> None:
        """The owner of the descriptor leaves; the next one may have it at once."""
        if descriptor in self.owners:
            self.leave(descriptor)
        if comes:
            name = b"peer%d" % len(self.peers)
            self.owners[descriptor], self.peers[name] = name, (key, descriptor)
            self.unseen.append(("came", descriptor))

    @rule(key=st.sampled_from(KEYS))
    def allow_or_revoke(self, key: str) -> None:
        if self.allowed.pop(key, None) is None:
            self.allowed[key] = ""

    @rule()
    def a_second_passes(self) -> None:
        self.second += 1

    @precondition(lambda self: self.owners or self.heard)
    @rule(data=st.data(), count=st.sampled_from([LIMIT + 1, 3, 1]), late=st.booleans())
    def speak(self, data: st.DataObject, count: int, late: bool) -> None:
        """Messages of one peer are read, which is there or has been heard before it left."""
        self.late = late
        gone = [name for name in self.peers if name in self.heard][-2:]
        name = data.draw(st.sampled_from(sorted({*self.owners.values(), *gone})))
        key, descriptor = self.peers[name]
        spoken = self.spoken[name, self.second]
        properties = {"User-Id": key, zmq.SRCFD: descriptor}
        frame = SimpleNamespace(get=properties.__getitem__, bytes=b"payload")
        self.arriving = [[SimpleNamespace(bytes=name), frame]] * count
        self.ended.clear()
        received = self.robot.receive()
        admitted = min(count, max(0, LIMIT - spoken)) if key in self.allowed else 0
        assert received == [(name, b"payload")] * admitted
        self.spoken[name, self.second] += count
        if not self.late:
            self.heard.add(name)
        is_there = self.owners.get(descriptor) == name
        assert set(self.ended) <= ({descriptor} if is_there else set()), "somebody else's connection was ended"
        if is_there and not self.late and admitted < count:
            assert self.ended, "who floods or was revoked keeps the connection"
        if self.ended:
            self.leave(descriptor)
        for one in (name, *self.owners.values(), b"nobody"):
            self.tell(one)

    def tell(self, name: bytes) -> None:
        may = name in self.robot._peers and self.peers[name][0] in self.allowed
        self.told.clear()
        dropped = self.robot.dropped
        assert (self.robot.send(name, b"stiffness"), self.told) == ((True, [name]) if may else (False, []))
        assert self.robot.dropped == dropped + (not may)


TestConnections = Connections.TestCase
TestConnections.settings = settings(
    derandomize=True,
    deadline=None,
    max_examples=200,
    stateful_step_count=30,
    phases=[Phase.explicit, Phase.generate],  # shrinking opens sockets by the thousand
)


def test_a_flooding_stranger_takes_nothing_from_the_operator_or_from_other_strangers() -> None:
    def seen(admission: Admission, *peers: bytes, operator: bytes | None = b"operator") -> list[bytes]:
        return [peer for peer, _ in admission.admitted([(peer, b"") for peer in peers], operator)]

    admission, flood = Admission(), [b"flood"] * 1000
    few = flood[:EACH_OTHER_PER_TICK]
    assert seen(admission, *flood, b"observer", b"operator", *flood, b"operator") == [
        *(*few, b"observer", b"operator", b"operator")
    ]
    assert admission.unread == 2000 - EACH_OTHER_PER_TICK
    assert seen(Admission(), *flood, operator=None) == few
    crowd = [b"%d" % number for number in range(100)]
    for _ in range(3):
        admission.begin_tick()
        assert len(seen(admission, *crowd)) == OTHERS_PER_TICK
        assert seen(admission, *crowd) == [], "however often one receives within the tick"


def test_of_a_crowd_the_oldest_newcomer_goes_and_who_was_introduced_stays() -> None:
    crowd = Crowd(limit=3, introduced_s=2.0)
    for descriptor in (0, 1, 2):
        crowd.came(descriptor, 0.0)
    assert list(crowd.surplus(0.0)) == []
    crowd.spoke(1)
    crowd.came(10, 1.9)
    assert (list(crowd.surplus(1.9)), crowd.hung_up) == ([0], 1)
    crowd.came(11, 2.1)
    # 2 has been introduced by now, or it would have ended.
    assert list(crowd.surplus(2.1)) == [10]
    crowd.spoke(11)
    crowd.came(12, 2.2)
    assert list(crowd.surplus(2.2)) == [12], "all the others are in"
    crowd.went(1)
    crowd.came(1, 2.3)
    crowd.came(13, 2.4)
    assert list(crowd.surplus(2.4)) == [1], "its number stands for another one"
    crowd.went(99)
    crowd.spoke(99)
    assert list(crowd.surplus(2.4)) == []
