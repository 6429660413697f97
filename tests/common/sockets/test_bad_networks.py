import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zmq

from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS


@pytest.fixture
def deaf_port() -> Iterator[int]:
    """Yield a port that answers no connection: its queue of one is full, so Linux drops further attempts."""
    with ExitStack() as stack:
        listener = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(3):
            filler = stack.enter_context(socket.socket())
            filler.setblocking(False)
            filler.connect_ex(listener.getsockname())
        yield listener.getsockname()[1]


def attempts(port: int) -> set[str]:
    """Return the local addresses from which connections to `port` are being attempted."""
    rows = (line.split() for line in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:])
    return {row[1] for row in rows if row[3] == "02" and row[2].endswith(f":{port:04X}")}  # SYN_SENT


def test_an_attempt_that_nobody_answers_is_given_up(deaf_port: int) -> None:
    seen = attempts(deaf_port)  # The last filler's attempt.
    with OperatorSockets(f"tcp://127.0.0.1:{deaf_port}", "tcp://127.0.0.1:9") as operator:
        before = len(seen)
        for _ in range(ROUNDS // 2):
            seen |= attempts(deaf_port)
            if len(seen) >= before + 2:
                return
            operator.wait(0.01)
    pytest.fail("only one connection attempt: the system repeats it ever more rarely, for two minutes")


def test_control_and_view_are_served_by_threads_of_their_own() -> None:
    # Resolving a name blocks its thread while a name server does not answer.
    with RobotSockets(EPHEMERAL) as robot, OperatorSockets(robot.control_endpoint, robot.view_endpoint) as operator:
        for end, parts in ((robot, [robot._control]), (operator, [way.part for way in operator._connections])):
            assert end._context.get(zmq.IO_THREADS) == 2
            assert {part.getsockopt(zmq.AFFINITY) for part in parts} == {1}
            assert end._view.getsockopt(zmq.AFFINITY) == 2


def test_the_end_waits_for_no_name_server(monkeypatch: pytest.MonkeyPatch) -> None:
    operator = OperatorSockets("tcp://127.0.0.1:9")
    answered, ended = threading.Event(), threading.Event()
    destroy = operator._context.destroy

    def stuck(context: "zmq.Context[zmq.Socket[bytes]]", linger: int) -> None:
        assert context is operator._context
        answered.wait(60.0)
        destroy(linger)
        ended.set()

    with monkeypatch.context() as patched:
        patched.setattr(zmq.Context, "destroy", stuck)
        operator.close()
        was_ended = ended.is_set()
        answered.set()
        assert ended.wait(60.0)
    assert not was_ended
