"""The robot side's report about the link: sent to the owner only, twice a second, and shown until it is too old."""

from collections.abc import Iterator

import msgspec
import pytest

from common.command.live_line import live_line
from common.command.live_view import LiveView
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LinkReport
from common.rate.budget import Budget
from common.sockets.tcp_figures import TcpFigures
from common.status.codes import LinkState
from common.status.statuses import RobotStatus
from operator_side.core import OperatorSide
from operator_side.robot_link.lease_state import REPORT_EXPIRES_S
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety, SafetySettings
from robot_side.reporting.link_reporter import PERIOD_S, LinkReporter
from robot_side.tick.outgoing import OutgoingStream

PICTURES = {"rate_hz": 15.0, "quality": 60, "size": 0.5}


@pytest.fixture
def session() -> OperatorSession:
    return OperatorSession(lambda: LinkEnd("robot", 7, "a clock"), Safety(SafetySettings()))


def reporter(session: OperatorSession, *tcp: TcpFigures) -> tuple[LinkReporter, Budget[OutgoingStream]]:
    budget: Budget[OutgoingStream] = Budget(("video", "scene"), 0)
    figures: Iterator[TcpFigures] = iter(tcp)
    return LinkReporter(session, budget, lambda: PICTURES, lambda _: next(figures)), budget


def report_of(made: LinkReporter, now_s: float) -> LinkReport:
    [outgoing] = made.due(now_s)
    assert (outgoing.stream, outgoing.peer) == ("haptics", b"owner")
    assert len(outgoing.payload) <= 200
    message = decode(outgoing.payload)
    assert isinstance(message, LinkReport)
    return message


def test_losses_and_what_was_held_back_are_those_since_the_last_report(session: OperatorSession) -> None:
    made, budget = reporter(session, TcpFigures(100, 50), TcpFigures(300, 54), TcpFigures(300, 54))
    assert made.due(0.0) == []
    session.receive(b"owner", encode(LinkEnd("operator", 2, "a clock").hello(0.0)), 0.0)
    assert report_of(made, 0.0).lost is None
    assert made.due(0.9 * PERIOD_S) == []
    for _ in range(5):
        budget.offer("video", b"picture", PERIOD_S)
    second = report_of(made, PERIOD_S)
    assert second.lost == 4 / 200
    assert second.pictures == "15 Hz, quality 60, size 0.5"
    assert second.held_back == "pictures 3 (rate)"
    assert msgspec.structs.replace(RobotStatus(), **made.status()).lost_percent == 2.0
    third = report_of(made, 2 * PERIOD_S)
    assert (third.lost, third.held_back) == (None, "")


def test_the_owner_sees_it_until_it_is_old(session: OperatorSession) -> None:
    made, _ = reporter(session, TcpFigures(100, 0), TcpFigures(300, 3))
    operator = OperatorSide(2, "another clock")
    session.receive(b"owner", operator.motion(0.0)[0].payload, 0.0)
    for answer in session.take_answers(0.0):
        operator.receive(answer.payload, 0.01)
    for now_s in (0.0, PERIOD_S):
        [outgoing] = made.due(now_s)
        operator.receive(outgoing.payload, now_s + 0.02)
    shown = operator.status(PERIOD_S + 0.02)
    assert (shown.lost_percent, shown.rate_kbit_s, shown.held_back) == (1.5, 1000.0, "")
    assert operator.status(PERIOD_S + 0.03 + REPORT_EXPIRES_S).lost_percent is None
    assert operator.rejected == 0


def test_the_line_has_a_queue_and_losses_where_there_are_some() -> None:
    status = RobotStatus(link=LinkState.UP, delay_ms=52.0, queue_ms=14.2, lost_percent=1.25)
    assert live_line(LiveView(status), 200).endswith("link 52ms  queue 14ms  lost 1.2%")
    status = msgspec.structs.replace(status, queue_ms=1.0, lost_percent=0.0)
    assert live_line(LiveView(status), 200).endswith("link 52ms")
