"""One owner, many observers: who gets the lease when, with virtual operators on a real robot side."""

import msgspec
import pytest

from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.messages import Hello, LeaseNotice, StiffnessUpdate
from common.protocol.session import SessionState
from feelahead.lab.faults.session_bench import CRUISE, QUICK, Bench, Operator
from robot_side.core import OBSERVER_PERIOD_S
from robot_side.operators.lease import MOST_AWAY, MOST_OBSERVERS


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


def test_observers_feel_at_a_reduced_rate_and_see_the_robots_state(bench: Bench) -> None:
    owner = bench.join(2)
    observer = bench.join(3, b"observer")
    bench.arm_it(owner)
    owner.inbox.clear()
    observer.inbox.clear()
    bench.drive(0.5, owner)
    assert len(owner.felt) == 500
    assert len(observer.felt) == pytest.approx(0.5 / OBSERVER_PERIOD_S, abs=1)
    assert observer.felt[-1].state == "armed"


def test_there_is_room_for_so_many_observers_and_the_next_is_told_so(bench: Bench) -> None:
    for k in range(1 + MOST_OBSERVERS):
        bench.join(2 + k, b"%d" % k)
    one_more = bench.join(100, b"one more")
    assert one_more.state is SessionState.UNKNOWN
    assert one_more.notice is not None
    assert "observe already" in one_more.notice.why
    assert bench.robot.session.refused == 1
    assert bench.robot.summary()["lease"]["refused"] == 1


def test_who_was_refused_is_admitted_when_there_is_room(bench: Bench) -> None:
    for k in range(1 + MOST_OBSERVERS):
        bench.join(2 + k, b"%d" % k)
    one_more = bench.join(100, b"one more")
    bench.silence(QUICK.safety.lease_s + 0.1)
    bench.say_hello(one_more)
    bench.tick()
    assert one_more.state is SessionState.DISARMED


def test_the_token_only_grows(bench: Bench) -> None:
    first, second = bench.join(2), bench.join(3, b"second")
    tokens = [first.token]
    for owner in (first, second, first, second):
        bench.drive(0.02, owner)
        bench.send(owner, hand_over=True)
        bench.tick(2)
        tokens.append(owner.token)
    assert tokens == sorted(set(tokens))


def test_the_token_grows_over_a_restart_of_the_robot_side() -> None:
    before, after = Bench(), Bench()
    before.silence(0.5)
    old = before.join(2)
    after.ticks = before.ticks + 10
    assert after.join(2).token > old.token > 0


def test_a_button_that_stays_down_hands_over_once(bench: Bench) -> None:
    first, second = bench.join(2), bench.join(3, b"second")
    bench.drive(0.02, first)
    bench.drive(0.1, first, hand_over=True)
    assert second.state is SessionState.DISARMED
    bench.drive(0.1, second, hand_over=False)
    bench.drive(0.1, second, hand_over=True)
    assert first.state is SessionState.DISARMED


def test_a_button_that_was_held_while_waiting_hands_nothing_over(bench: Bench) -> None:
    first, second = bench.join(2), bench.join(3, b"second")
    bench.drive(0.02, first)
    bench.drive(0.02, first, hand_over=True)
    bench.drive(0.1, second, hand_over=True)
    assert (first.state, second.state) == (SessionState.OBSERVING, SessionState.DISARMED)


def test_without_observers_the_button_changes_nothing(bench: Bench) -> None:
    owner = bench.join(2)
    bench.cruise(owner)
    token = owner.token
    bench.drive(0.05, owner, r2=CRUISE, hand_over=True)
    assert (bench.state, owner.token) == ("armed", token)


def test_a_dead_observer_does_not_get_the_lease(bench: Bench) -> None:
    owner = bench.join(2)
    dead = bench.join(3, b"dead")
    for step in range(1200):
        bench.tick()
        if step % 4 == 0:
            bench.send(owner)
    alive = bench.join(4, b"alive")
    bench.send(owner)
    bench.send(owner, hand_over=True)
    bench.tick(2)
    assert alive.state is SessionState.DISARMED
    assert dead.state is not SessionState.DISARMED


def test_an_owner_without_commands_keeps_its_lease_while_it_says_hello(bench: Bench) -> None:
    owner = bench.join(2)
    bench.join(3, b"observer")
    for _ in range(10):
        bench.silence(0.2)
        bench.say_hello(owner)
    assert owner.state is SessionState.DISARMED


def test_an_observers_emergency_stop_does_not_count_and_the_owners_always_does(bench: Bench) -> None:
    owner, other = bench.join(2), bench.join(3, b"other")
    bench.cruise(owner)
    bench.send(other, emergency_stop=True)
    assert bench.state == "armed"
    bench.send(owner, token=owner.token - 1, emergency_stop=True)
    assert bench.state == "stopped"
    assert bench.robot.session.not_owners == 2


def test_the_owner_may_come_back_over_another_connection(bench: Bench) -> None:
    owner = bench.join(2)
    bench.arm_it(owner)
    elsewhere = bench.operators[b"elsewhere"] = owner
    elsewhere.peer = b"elsewhere"
    bench.drive(0.05, elsewhere, r2=CRUISE)
    assert bench.state == "armed"
    assert owner.felt[-1].state == "armed"


def test_a_replay_from_elsewhere_does_not_divert_the_answers(bench: Bench) -> None:
    owner = bench.join(2)
    old = bench.send(owner)
    bench.drive(0.05, owner)
    thief = bench.operators[b"thief"] = Operator(99, b"thief")
    bench.robot.receive(b"thief", old, bench.now_s)
    owner.inbox.clear()
    bench.tick(5)
    assert len(owner.felt) == 5
    assert thief.inbox == []


def test_the_old_epoch_of_a_restarted_operator_is_over(bench: Bench) -> None:
    bench.cruise(bench.join(2))
    restarted = bench.join(3)
    assert bench.state == "disarmed"
    assert restarted.state is SessionState.DISARMED
    late = bench.operator(2)
    bench.say_hello(late)
    bench.tick()
    assert late.state is SessionState.ENDED
    assert bench.robot.session.refused == 1


def test_only_so_many_that_went_away_are_remembered(bench: Bench) -> None:
    joined = MOST_AWAY + 2
    for k in range(joined):
        bench.join(2 + k, b"%d" % k)
        bench.silence(QUICK.safety.lease_s + 0.05)
    assert sum(1 for _ in bench.robot.session.lease.known()) == MOST_AWAY
    returning, forgotten = Operator(2 + joined - 1, b"returning"), Operator(2, b"forgotten")
    bench.operators = {one.peer: one for one in (returning, forgotten)}
    bench.say_hello(returning)
    bench.tick(101)
    bench.say_hello(forgotten)
    bench.tick()
    assert forgotten.state is SessionState.ENDED


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


def test_a_refusal_reaches_the_status_and_the_summary(bench: Bench) -> None:
    owner, _ = bench.join(2), bench.join(3, b"observer")
    bench.drive(0.02, owner)
    status = bench.robot.status(bench.now_s)
    assert (status["owner"], status["observers"], status["refused"]) == ("disarmed", 1, 0)
    lease = bench.robot.summary()["lease"]
    assert (lease["granted"], lease["observers"], lease["commands_of_non_owners"]) == (1, 1, 0)


def test_each_message_to_an_operator_is_newer_than_the_one_before(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.3, operator)
    orders = [message.header.sequence for message in operator.inbox]
    assert orders == sorted(set(orders))
    assert operator.link.stale == 0
    kinds = {type(message) for message in operator.inbox}
    assert kinds == {Hello, LeaseNotice, StiffnessUpdate}


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


def test_who_says_no_hello_hears_which_place_it_would_get(bench: Bench) -> None:
    assert place_of_a_stranger(bench) == 0
    owner = bench.join(2)
    assert place_of_a_stranger(bench) == 1
    observer = bench.join(3, b"observer")
    assert place_of_a_stranger(bench) == 2
    assert (owner.state, observer.state) == (SessionState.DISARMED, SessionState.OBSERVING)


def cruise_beside(asks: bool) -> tuple[list[tuple[float, float]], list[StiffnessUpdate]]:
    bench = Bench()
    owner, stranger = bench.join(2), Operator(99, b"stranger")
    bench.arm_it(owner)
    for _ in range(5):
        bench.drive(0.1, owner, r2=CRUISE)
        if asks:
            bench.robot.receive(stranger.peer, stranger.command(bench.now_s), bench.now_s)
    assert bench.robot.session.rejected == (5 if asks else 0)
    return list(bench.arm.speeds_rad_s), owner.felt


def test_whoever_drives_notices_nothing_of_a_stranger_who_asks() -> None:
    (speeds, felt), (undisturbed, felt_alone) = cruise_beside(asks=True), cruise_beside(asks=False)
    assert speeds == undisturbed
    stripped = [[msgspec.structs.replace(one, header=felt[0].header) for one in each] for each in (felt, felt_alone)]
    assert stripped[0] == stripped[1]
