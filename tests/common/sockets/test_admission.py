"""Who is heard, who is told and who is hung up on: over a crowd, a flood and a revocation."""

from types import SimpleNamespace
from typing import Any

import pytest
import zmq

from common.clock import MonotonicClock
from common.sockets import robot as robot_sockets
from common.sockets.admission import EACH_OTHER_PER_TICK, OTHERS_PER_TICK, Admission
from common.sockets.crowd import Crowd
from common.sockets.robot import RobotSockets
from tests.helpers.socket_talk import EPHEMERAL


class Clock(MonotonicClock):
    def __init__(self) -> None:
        self.second = 0

    def now(self) -> float:
        return float(self.second)


class Frame:
    """One that came by a connection."""

    def __init__(self, key: str, descriptor: int) -> None:
        self._properties: dict[Any, Any] = {"User-Id": key, zmq.SRCFD: descriptor}
        self.bytes = b"payload"

    def get(self, name: Any) -> Any:
        return self._properties[name]


def test_five_thousand_messages_a_second_are_heard_of_each_peer(monkeypatch: pytest.MonkeyPatch) -> None:
    with RobotSockets(EPHEMERAL) as robot:
        monkeypatch.setattr(robot, "_clock", Clock())
        frames = [[SimpleNamespace(bytes=b"peer"), Frame("", -1)]] * 5100
        monkeypatch.setattr(robot._inbox, "read", lambda: frames)
        assert len(robot.receive()) == 5000
        assert robot.flooding == 100


@pytest.mark.parametrize(("doubt", "ended"), [("none", [7]), ("events wait", []), ("used again", []), ("gone", [])])
def test_who_floods_is_hung_up_on_where_it_is_known_whose_the_connection_is(
    monkeypatch: pytest.MonkeyPatch, doubt: str, ended: list[int]
) -> None:
    shut: list[int] = []
    monkeypatch.setattr(robot_sockets, "_shut_down", shut.append)
    monkeypatch.setattr(robot_sockets, "PEER_LIMIT_PER_S", 1)
    with RobotSockets(EPHEMERAL) as robot:
        monkeypatch.setattr(robot, "_watch_connections", lambda: None)
        robot._gates[0].crowd.came(7, 0.0)
        robot._all_seen = True
        assert robot._admits(b"peer", Frame("", 7))  # type: ignore[arg-type]
        if doubt == "events wait":
            robot._all_seen = False
        elif doubt == "used again":
            robot._spoke_by[7] = b"another"
        elif doubt == "gone":
            robot._gates[0].crowd.went(7)
        assert not robot._admits(b"peer", Frame("", 7))  # type: ignore[arg-type]
    assert shut == ended


def test_a_revoked_peer_known_whose_connection_stands_is_told_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    with RobotSockets(EPHEMERAL) as robot:
        names = {"anna's": "anna"}
        monkeypatch.setattr(robot, "_keys", SimpleNamespace(allowed=SimpleNamespace(names=names)))
        monkeypatch.setattr(robot, "send_frames", lambda *_: True)
        assert robot._admits(b"peer", Frame("anna's", 7))  # type: ignore[arg-type]
        assert robot.send(b"peer", b"stiffness")
        names.clear()
        assert not robot.send(b"peer", b"stiffness")
        assert robot.dropped == 1


# Within a tick


def admitted(admission: Admission, *peers: bytes, operator: bytes | None = b"operator") -> list[bytes]:
    return [peer for peer, _ in admission.admitted([(peer, b"") for peer in peers], operator)]


def test_a_flooding_stranger_takes_nothing_from_the_operator_or_from_other_strangers() -> None:
    admission = Admission()
    seen = admitted(admission, *[b"flood"] * 1000, b"observer", b"operator", *[b"flood"] * 1000, b"operator")
    assert seen == [b"flood"] * EACH_OTHER_PER_TICK + [b"observer", b"operator", b"operator"]
    assert admission.unread == 2000 - EACH_OTHER_PER_TICK
    assert admitted(Admission(), *[b"operator"] * 100, operator=None) == [b"operator"] * EACH_OTHER_PER_TICK


def test_a_crowd_of_strangers_is_bounded_as_a_whole_in_each_tick() -> None:
    admission = Admission()
    crowd = [b"%d" % number for number in range(100)]
    for _ in range(3):
        admission.begin_tick()
        # However often one receives within the tick.
        assert len(admitted(admission, *crowd)) == OTHERS_PER_TICK
        assert admitted(admission, *crowd) == []
    assert admission.unread == 3 * (200 - OTHERS_PER_TICK)


# At one port


LIMIT, INTRODUCED_S = 3, 2.0


def surplus(crowd: Crowd, now_s: float) -> list[int]:
    return list(crowd.surplus(now_s))


def full(now_s: float = 0.0) -> Crowd:
    crowd = Crowd(LIMIT, INTRODUCED_S)
    for descriptor in range(LIMIT):
        crowd.came(descriptor, now_s)
    assert surplus(crowd, now_s) == []
    return crowd


def test_the_oldest_newcomer_goes_when_another_one_comes() -> None:
    crowd = full()
    crowd.came(10, 0.1)
    crowd.came(11, 0.1)
    assert surplus(crowd, 0.1) == [0, 1]
    assert surplus(crowd, 0.1) == []
    assert crowd.hung_up == 2


def test_who_has_spoken_stays_and_so_does_who_has_been_there_for_long() -> None:
    crowd = full()
    crowd.spoke(1)
    crowd.came(10, 1.9)
    assert surplus(crowd, 1.9) == [0]
    crowd.came(11, 2.1)
    # 2 has been introduced by now, or it would have ended.
    assert surplus(crowd, 2.1) == [10]


def test_when_all_the_others_are_in_the_new_one_goes() -> None:
    crowd = full()
    crowd.came(10, 5.0)
    assert surplus(crowd, 5.0) == [10]


def test_who_went_leaves_room_and_its_number_stands_for_another_one() -> None:
    crowd = full()
    for descriptor in range(LIMIT):
        crowd.spoke(descriptor)
    crowd.went(1)
    crowd.came(1, 1.0)
    assert surplus(crowd, 1.0) == []
    crowd.came(10, 1.1)
    assert surplus(crowd, 1.1) == [1]
    crowd.went(1)
    crowd.went(1)
    crowd.spoke(99)
    assert surplus(crowd, 1.2) == []
