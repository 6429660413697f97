"""An operator side that the robot side has forgotten: it asks again under another epoch."""

import pytest

from common.protocol.codec import decode, encode
from common.protocol.messages import Hello, LeaseNotice, StiffnessUpdate
from common.protocol.session import SessionState
from feelahead.lab.faults import session_bench
from feelahead.lab.faults.session_bench import COMMAND_PERIOD_TICKS, QUICK, Operator
from operator_side.core import OperatorSide
from robot_side.operators.lease import MOST_AWAY
from tests.operator_side.operator_bench import Bench


class WholeOperator(Operator):
    """One whose end is a real operator side without a controller."""

    def __init__(self, epoch: int, peer: bytes) -> None:
        super().__init__(epoch, peer)
        self.side = OperatorSide(epoch, "clock")

    def take(self, message: StiffnessUpdate | Hello | LeaseNotice, now_s: float) -> None:
        super().take(message, now_s)
        self.side.receive(encode(message), now_s)

    def live(self, bench: session_bench.Bench, duration_s: float) -> None:
        """Everything that it has to say arrives."""
        for tick in range(round(1e3 * duration_s)):
            if tick % COMMAND_PERIOD_TICKS == 0:
                for payload in self.side.motion(bench.now_s):
                    bench.robot.receive(self.peer, payload, bench.now_s)
            bench.tick()


def test_others_that_come_and_go_lock_out_nobody_who_was_silent() -> None:
    bench = session_bench.Bench()
    honest = bench.operators[b"honest"] = WholeOperator(2, b"honest")
    honest.live(bench, 0.3)
    assert honest.state is SessionState.DISARMED
    for k in range(MOST_AWAY + 1):
        bench.join(100 + k, b"%d" % k)
    bench.silence(QUICK.safety.lease_s + 0.1)
    assert bench.robot.session.lease.has_ended(2)
    honest.live(bench, 1.0)
    assert honest.state is SessionState.DISARMED
    assert honest.side.status(bench.now_s)["owner"] == "disarmed"
    assert honest.side.summary()["lease_states"] == ["owner", "ended", "owner"]


def epoch_of(bench: Bench) -> int:
    [hello] = [decode(payload) for payload in bench.side.motion(bench.now_s)]
    assert isinstance(hello, Hello)
    return hello.header.epoch


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_an_epoch_that_ended_is_followed_by_another_and_not_by_a_third_for_what_was_under_way(bench: Bench) -> None:
    epochs = [epoch_of(bench)]
    for after_s in (0.3, 0.3, 2.0, 2.0, 1.0):
        bench.now_s += after_s
        bench.notice(SessionState.ENDED)
        epochs.append(epoch_of(bench))
    first, *rest, last = epochs
    assert len({first, *rest, last}) == 3
    assert set(rest) == {rest[0]}


@pytest.mark.parametrize("session", [state for state in SessionState if state is not SessionState.ENDED])
def test_no_other_standing_changes_the_epoch(bench: Bench, session: SessionState) -> None:
    before = epoch_of(bench)
    bench.now_s += 0.3
    bench.notice(session)
    assert epoch_of(bench) == before
