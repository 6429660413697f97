"""The ends that take turns in `feelahead bench link`: ours exchange what they should, and bare ones as many bytes."""

from collections.abc import Iterator

import pytest

from common.protocol.codec import decode
from common.protocol.messages import MotionCommand, StiffnessUpdate
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.benchmarks.link.ends import BYTES, OperatorEnd, RobotEnd
from feelahead.benchmarks.link.turns import KINDS, Share, ratio, take_turns
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S


@pytest.fixture
def robot() -> Iterator[RobotSockets]:
    with RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as opened:
        yield opened


def test_our_ends_drive_and_feel_with_messages_of_the_size_that_bare_ends_send(robot: RobotSockets) -> None:
    sent: list[bytes] = []
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator:
        ours, theirs = RobotEnd(robot), OperatorEnd(operator)
        here, there = robot.send, operator.send
        robot.send = lambda peer, payload: sent.append(payload) or here(peer, payload)  # type: ignore[method-assign, func-returns-value]
        operator.send = lambda payload: sent.append(payload) or there(payload)  # type: ignore[method-assign, func-returns-value]
        robot_turns, operator_turns = ours.run(0.0, 1e12, 1e-3), theirs.run(0.0, 1e12, 1e-3)
        for _ in range(60_000):
            next(robot_turns)
            next(operator_turns)
            kinds = [type(decode(payload)) for payload in sent[-4:]]
            if MotionCommand in kinds and StiffnessUpdate in kinds and len(sent) > 1000:
                break
        else:
            pytest.fail("no commands and fields")
    assert ours.sent > 100
    assert theirs.sent > 100
    for kind, name in ((StiffnessUpdate, "robot"), (MotionCommand, "operator")):
        sizes = [len(payload) for payload in sent if isinstance(decode(payload), kind)]
        assert abs(max(sizes) - BYTES[name]) <= 0.1 * BYTES[name]


def test_each_turn_is_compared_with_the_peer_of_the_same_turn() -> None:
    slow, fast = Share(0.4, 0.2, 1000.0), Share(0.2, 0.1, 1000.0)
    bare_slow, bare_fast = Share(0.3, 0.2, 1000.0), Share(0.15, 0.1, 1000.0)
    assert ratio([slow, fast], [bare_slow, bare_fast]) == pytest.approx(1.2)


@pytest.mark.processes
def test_every_kind_sends_and_is_measured() -> None:
    found = take_turns(0.3, 1, 0.005, lambda _: None)
    assert set(found) == set(KINDS)
    for (share,) in found.values():
        assert share.sent_per_s > 0.0
        assert share.both > 0.0
