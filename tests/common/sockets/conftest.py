"""The sockets of both sides, connected on loopback."""

from collections.abc import Iterator

import pytest

from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S


@pytest.fixture
def robot() -> Iterator[RobotSockets]:
    with RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as opened:
        yield opened


@pytest.fixture
def operator(robot: RobotSockets) -> Iterator[OperatorSockets]:
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as opened:
        yield opened
