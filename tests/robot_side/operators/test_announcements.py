"""What the owner of the lease and observers are sent over time, with simulated operators on a real robot side."""

import msgspec
import numpy as np
import pytest

from common.peer_name import peer_name
from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.messages import AnyMessage, Hello, LeaseNotice, StiffnessUpdate
from common.protocol.session import SessionState
from common.silence import KEEP_ALIVE_S
from robot_side.operators.lease import MOST_OBSERVERS
from robot_side.reporting.reports import OBSERVER_PERIOD_S
from tests.robot_side.session_bench import Bench, Operator


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_the_first_owns_and_the_next_observe(bench: Bench) -> None:
    operators = [bench.join(2 + k, b"%d" % k) for k in range(3)]
    assert [one.state for one in operators] == [SessionState.DISARMED, SessionState.OBSERVING, SessionState.OBSERVING]
    bench.silence(0.06)
    notices = [one.notice for one in operators]
    assert [notice.place for notice in notices if notice is not None] == [0, 1, 2]
    assert [notice.waiting for notice in notices if notice is not None] == [2, 2, 2]
    assert {one.token for one in operators} == {bench.robot.session.lease.token}


def test_a_key_that_may_only_observe_never_owns_nor_is_handed_the_lease(bench: Bench) -> None:
    observer = bench.join(2, peer_name("observer", b"one", observes=True))
    assert observer.state is SessionState.OBSERVING
    driver = bench.join(3, peer_name("driver", b"two"))
    assert driver.state is SessionState.DISARMED
    assert not bench.robot.session.lease.hand_over(bench.now_s)
    bench.silence(1.0)
    bench.say_hello(observer)
    assert bench.robot.session.lease.owner is None


def test_observers_feel_at_a_reduced_rate_and_see_the_robots_state(bench: Bench) -> None:
    owner = bench.join(2)
    observer = bench.join(3, b"observer")
    bench.arm_it(owner)
    owner.inbox.clear()
    observer.inbox.clear()
    bench.drive(0.5, owner)
    assert len(owner.updates) == pytest.approx(0.5 / KEEP_ALIVE_S, abs=1)  # Nothing changes.
    assert len(observer.updates) == pytest.approx(0.5 / OBSERVER_PERIOD_S, abs=1)
    assert observer.updates[-1].state == "armed"


def to_owner(bench: Bench, ticks: int) -> list[tuple[float, bool, AnyMessage]]:
    """Tick; return each message of the stream "haptics" as (time, whether it went over all connections, message)."""
    found = []
    for _ in range(ticks):
        bench.ticks += 1
        sent = [one for one in bench.robot.tick(bench.now_s) if one.stream == "haptics"]
        found += [(bench.now_s, one.everywhere, decode(one.payload)) for one in sent]
    return found


def test_what_is_new_goes_everywhere_and_what_is_repeated_in_turn(bench: Bench) -> None:
    owner = bench.operator(2)
    bench.say_hello(owner)
    first = to_owner(bench, 500)
    for kind in (Hello, LeaseNotice, StiffnessUpdate):
        assert next(everywhere for _, everywhere, one in first if isinstance(one, kind))
    notices_s = [now_s for now_s, _, one in first if isinstance(one, LeaseNotice)][1:]
    assert np.diff(notices_s) == pytest.approx(0.1, abs=0.0011)
    assert sum(everywhere for _, everywhere, _ in first) == 3
    bench.send(owner, emergency_stop=True)
    after = to_owner(bench, 100)
    for kind in (LeaseNotice, StiffnessUpdate):
        (now_s, everywhere, one), *later = [sent for sent in after if isinstance(sent[2], kind)]
        assert (now_s, everywhere) == (after[0][0], True)
        assert "stopped" in (getattr(one, "session", None), getattr(one, "state", None))
        assert not any(everywhere for _, everywhere, _ in later)


def test_a_refusal_goes_everywhere(bench: Bench) -> None:
    bench.send(bench.operator(2))
    assert [(everywhere, type(one)) for _, everywhere, one in to_owner(bench, 1)] == [
        (True, Hello),
        (True, LeaseNotice),
    ]


def test_the_number_of_observers_is_limited_and_the_next_is_refused(bench: Bench) -> None:
    for k in range(1 + MOST_OBSERVERS):
        bench.join(2 + k, b"%d" % k)
    one_more = bench.join(100, b"one more")
    assert one_more.state is SessionState.UNKNOWN
    assert one_more.notice is not None
    assert "observe already" in one_more.notice.why
    assert bench.robot.session.refused == 1
    assert bench.robot.summary()["lease"]["refused"] == 1


def test_hellos_are_answered_at_a_bounded_rate(bench: Bench) -> None:
    operator = bench.join(2)
    operator.inbox.clear()
    for _ in range(1000):
        bench.say_hello(operator)
    for stranger in range(1000):
        bench.robot.receive(b"stranger", Operator(5000 + stranger, b"").command(bench.now_s), bench.now_s)
    outgoing = bench.robot.tick(bench.now_s + 0.001)
    assert len(outgoing) < 10


def test_an_old_peer_is_refused_whole_counted_and_told(bench: Bench) -> None:
    stranger = bench.operator(2)
    version = bytes([0x92, PROTOCOL_VERSION - 1])
    payload = version + encode(stranger.link.hello(bench.now_s))[2:]
    bench.robot.receive(stranger.peer, payload, bench.now_s)
    bench.tick()
    assert bench.robot.session.other_version == bench.robot.session.rejected == 1
    assert bench.robot.summary()["lease"]["other_version"] == 1
    assert stranger.notice is not None
    assert stranger.notice.why == f"protocol version {PROTOCOL_VERSION - 1}; valid: {PROTOCOL_VERSION}"


def test_a_robot_does_not_take_a_robot_for_an_operator(bench: Bench) -> None:
    stranger = bench.operator(2)
    hello = msgspec.structs.replace(stranger.link.hello(bench.now_s), side="robot")
    assert decode(encode(hello)) == hello
    bench.robot.receive(stranger.peer, encode(hello), bench.now_s)
    assert bench.robot.session.rejected == 1
    assert bench.robot.session.lease.owner is None


def place_of_a_stranger(bench: Bench) -> int:
    stranger = bench.operator(99, b"stranger")
    bench.silence(0.1)
    bench.send(stranger)
    bench.tick()
    assert stranger.notice is not None
    assert stranger.notice.session is SessionState.UNKNOWN
    return stranger.notice.place


def test_a_peer_without_hello_hears_the_place_it_would_get(bench: Bench) -> None:
    assert place_of_a_stranger(bench) == 0
    owner = bench.join(2)
    assert place_of_a_stranger(bench) == 1
    observer = bench.join(3, b"observer")
    assert place_of_a_stranger(bench) == 2
    assert (owner.state, observer.state) == (SessionState.DISARMED, SessionState.OBSERVING)
