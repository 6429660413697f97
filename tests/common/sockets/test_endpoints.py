import re
from collections.abc import Callable

import pytest

from common.errors import ConfigurationError
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from tests.helpers.refusal import refusal
from tests.helpers.socket_talk import EPHEMERAL, greet, publish_until_seen


def port_of(endpoint: str) -> int:
    return int(endpoint.rsplit(":", 1)[1])


def test_the_view_follows_the_control_port() -> None:
    for _ in range(20):
        with RobotSockets(EPHEMERAL) as probe:
            control = probe.control_endpoint
        try:
            robot = RobotSockets(control)
        except ConfigurationError:
            continue  # Another program has one of the two ports.
        with robot, OperatorSockets(control) as operator:
            assert port_of(robot.view_endpoint) == port_of(control) + 1
            publish_until_seen(robot, operator, b"telemetry")
            return
    pytest.fail("no two ports in a row are free")


MALFORMED = [
    *("", "tcp//x", "127.0.0.1:5555", "ipc:///tmp/control", "udp://127.0.0.1:5555", "tcp://127.0.0.1", "tcp://:5555"),
    *("tcp://127.0.0.1:5555/path", "tcp://127.0.0.1:", "tcp://127.0.0.1:http", "tcp://127.0.0.1:-1"),
    *("tcp://127.0.0.1:65536", "tcp://127.0.0.1:+80", "tcp://127.0.0.1:٥٥٥٥", "tcp://10.0.0.1;127.0.0.1:5555"),
]


OPEN = ("tcp://0.0.0.0:0", "tcp://*:0", "tcp://192.0.2.1:5555")
"""Addresses that other machines reach"""
ENDS: dict[str, Callable[[str], object]] = {
    "--bind": RobotSockets,
    "--view-bind": lambda address: RobotSockets(EPHEMERAL, address),
    "--connect": OperatorSockets,
    "--view-connect": lambda address: OperatorSockets("tcp://127.0.0.1:5555", address),
}


@pytest.mark.parametrize(
    ("flag", "address", "said"),
    [
        *((flag, address, "") for flag in ENDS for address in MALFORMED),
        # The top-level domain is reserved for names that never resolve (RFC 6761).
        *(
            (flag, "tcp://robot.invalid:5555", "'robot.invalid'.* cannot be resolved")
            for flag in ("--bind", "--connect")
        ),
        *((flag, address, "keys.*--insecure") for flag in ("--bind", "--view-bind") for address in OPEN),
    ],
)
def test_refuses_what_is_no_address_or_none_to_use(flag: str, address: str, said: str) -> None:
    text = refusal(ENDS[flag], address)
    assert "valid: " in text
    assert text.startswith(f"{flag}: ")
    assert repr(address) in text
    assert re.search(said, text)


def test_says_which_port_is_in_use(robot: RobotSockets) -> None:
    for flag, make in (
        ("--bind", lambda: RobotSockets(robot.control_endpoint)),
        ("--view-bind", lambda: RobotSockets(EPHEMERAL, robot.control_endpoint)),
    ):
        text = refusal(make)
        assert "valid: " in text
        assert text.startswith(f"{flag}: cannot bind {robot.control_endpoint}: the port is in use")
        suggested = re.findall(r"tcp://127\.0\.0\.1:(\d+)", text)[-1]
        assert 0 < int(suggested) <= 65535
        assert int(suggested) != port_of(robot.control_endpoint)


def test_a_refused_view_frees_the_control_port(robot: RobotSockets) -> None:
    with RobotSockets(EPHEMERAL) as probe:
        control = probe.control_endpoint
    refusal(lambda: RobotSockets(control, robot.view_endpoint))
    with RobotSockets(control, EPHEMERAL) as second:
        assert second.control_endpoint == control


def test_listens_on_the_network_when_told_so() -> None:
    with RobotSockets("tcp://*:0", insecure=True) as robot:
        control, view = (f"tcp://127.0.0.1:{port_of(end)}" for end in (robot.control_endpoint, robot.view_endpoint))
        with OperatorSockets(control, view) as operator:
            greet(robot, operator)


def test_the_last_port_leaves_no_room_for_the_view() -> None:
    for make in (RobotSockets, OperatorSockets):
        assert "'tcp://127.0.0.1:65535' leaves no port after it" in refusal(make, "tcp://127.0.0.1:65535")
