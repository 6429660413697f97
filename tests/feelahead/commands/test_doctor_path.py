"""`feelahead doctor --connect` measures the path: verdicts on invented figures, and a measurement on loopback."""

import json
from typing import Any, cast

import pytest

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.view_messages import VIDEO_TOPIC, VideoFrame
from common.sockets.tcp_figures import TcpFigures
from feelahead.commands.doctor import path
from feelahead.commands.doctor.path import judged, path_line
from feelahead.main import command
from tests.helpers.machines.waiting import wait_until
from tests.helpers.messages import uniform_update
from tests.helpers.serving_robot import ServingRobot

VIEW: dict[str, Any] = {"rate_hz": 12.0, "age_p95_ms": 240.0}
FINE: dict[str, Any] = {
    "round_trip_ms": {"p50": 200.0, "p95": 212.0},
    "queue_p95_ms": 6.0,
    "longest_silence_ms": 31.0,
    "received_kbit_s": 480.0,
    "sent_again": 0.011,
    "views": {"first_person": VIEW, "overview": VIEW},
}
NOTHING: dict[str, Any] = {"round_trip_ms": {"p50": None, "p95": None}, "longest_silence_ms": 5e3, "views": {}}


@pytest.mark.parametrize(
    ("others", "linked", "works", "views", "said"),
    [
        ({}, True, True, 2, "what works: the arm and both views"),
        ({"views": {"first_person": VIEW, "overview": VIEW | {"rate_hz": 2.0}}}, True, True, 1, "the arm and one view"),
        ({"views": {"first_person": VIEW | {"age_p95_ms": 800.0}}}, True, True, 0, "works: the arm alone"),
        ({"views": {}}, True, True, 0, "no pictures came"),
        ({"longest_silence_ms": 100.0}, True, False, 2, "again and again: silences reach the limit of 100 ms"),
        ({}, False, False, 2, "stop again and again"),
        (NOTHING, False, False, 0, "nothing measured"),
    ],
)
def test_the_verdict(others: dict[str, Any], linked: bool, works: bool, views: int, said: str) -> None:
    path = judged(FINE | others, linked=linked)
    assert (path["arm_works"], path["views_that_work"]) == (works, views)
    assert said in path_line(path)


def test_lost_packets_are_a_share_of_those_sent_meanwhile() -> None:
    figures = TcpFigures(sent=300, sent_again=5).since(TcpFigures(sent=100, sent_again=3))
    assert figures.lost_share == 0.01
    assert figures.since(figures).lost_share is None


class _Filming(ServingRobot):
    """Robot side that sends stiffness to all, and while it is watched a picture, 50 ms old, in each turn."""

    def tick(self, now_s: float) -> None:
        for one in [*self.session.owners(now_s), *self.session.observers(now_s)]:
            self.sockets.send(one.peer, encode(uniform_update(one.header, state="disarmed")))
        if "overview" in self.session.watchers.looked_at(now_s):
            header = self.session.shown_header(now_s)
            frame = VideoFrame(header, "overview", captured_s=now_s - 0.05, width=4, height=4, jpeg=b"picture")
            self.sockets.publish(VIDEO_TOPIC, encode(frame))


@pytest.mark.parametrize("taken", [False, True])
def test_the_path_is_measured_and_the_arm_stays_disarmed(
    taken: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(path, "MEASURE_S", 0.5)
    with _Filming() as robot:
        if taken:
            owner = LinkEnd("operator", 2, "an operator's")
            now_s = robot._clock.now()
            robot.session.receive(b"owner", encode(owner.hello(now_s)), now_s)

        def measured() -> tuple[int, dict[str, Any]]:
            code = command(["doctor", "--connect", robot.control, "--view-connect", robot.view, "--json"])
            return code, json.loads(capsys.readouterr().out)["path"]

        # On a machine that stalls, no picture may come in so short a time.
        code, told = wait_until("pictures", lambda: found if (found := measured())[1]["views"] else None)
        assert robot.session.safety.state == "disarmed"
        assert (robot.session.owner_peer == b"owner") is taken
        assert robot.session.leases_granted >= 1
    assert told == judged(told, linked=True)
    assert code == (0 if told["arm_works"] else 1)
    assert told["round_trip_ms"]["p95"] >= told["round_trip_ms"]["p50"] > 0.0
    assert cast(float, told["views"]["overview"]["age_p95_ms"]) >= 50.0
    assert told["received_kbit_s"] > 0.0
