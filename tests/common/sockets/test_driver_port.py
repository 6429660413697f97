from pathlib import Path

import pytest
import zmq

from common.errors import ConfigurationError
from common.sockets.authentication import OperatorKeys, RobotKeys, make_key_pair
from common.sockets.driver_port import DriverPort
from common.sockets.keys import KeyFolder
from tests.helpers.socket_talk import EPHEMERAL

LIMIT_BYTES = 4096
_ROUNDS = 2000


def driver(context: "zmq.Context[zmq.Socket[bytes]]", port: DriverPort, name: bytes) -> "zmq.Socket[bytes]":
    part = context.socket(zmq.DEALER)
    part.setsockopt(zmq.ROUTING_ID, name)
    part.setsockopt(zmq.LINGER, 0)
    part.connect(port.endpoint)
    return part


def refreshed(port: DriverPort) -> list[str]:
    """Read the allow-list again, as the door does for all ports; return the news."""
    assert port._keys is not None
    port._keys.allowed.refresh()
    return port.news()


def heard(port: DriverPort) -> list[tuple[bytes, bytes]]:
    for _ in range(_ROUNDS):
        port.wait(0.01)
        if found := port.receive():
            return [(one.peer, one.payload) for one in found]
    pytest.fail("nothing comes")


def test_messages_go_both_ways_with_the_time_at_which_they_were_taken() -> None:
    with DriverPort(EPHEMERAL, "--arm", LIMIT_BYTES) as port, zmq.Context() as context:
        with driver(context, port, b"one") as part:
            part.send(b"state")
            before_s = port.wait(60.0)
            ((peer, payload, received_s),) = port.receive()
            assert (peer, payload) == (b"one", b"state")
            assert before_s <= received_s <= port.wait(0.0)
            assert port.send(b"one", b"command")
            assert part.recv() == b"command"
            part.send_multipart([b"two", b"frames"])
            part.send(b"state")
            assert heard(port) == [(b"one", b"state")]
            assert port.rejected == 1
        assert not port.send(b"nobody", b"command")
        assert port.dropped == 1


def test_a_driver_that_is_back_under_its_name_takes_its_place() -> None:
    with (
        DriverPort(EPHEMERAL, "--arm", LIMIT_BYTES) as port,
        zmq.Context() as context,
        driver(context, port, b"one") as gone,
    ):
        gone.send(b"before")
        assert heard(port) == [(b"one", b"before")]
        with driver(context, port, b"one") as back:
            back.send(b"after")
            assert heard(port) == [(b"one", b"after")]


@pytest.mark.parametrize("flag", ["--arm", "--objects"])
def test_beyond_this_machine_it_asks_for_keys_in_the_words_of_the_control_port(flag: str) -> None:
    with pytest.raises(
        ConfigurationError, match=rf"{flag}: 'tcp://\*:0' would be open to anyone on the network.*--inse"
    ):
        DriverPort("tcp://*:0", flag, LIMIT_BYTES)
    DriverPort("tcp://*:0", flag, LIMIT_BYTES, insecure=True).close()
    with pytest.raises(ConfigurationError, match=rf"{flag}: 'here' is no address"):
        DriverPort("here", flag, LIMIT_BYTES)


def test_a_key_gets_in_once_it_is_allowed_and_is_not_heard_once_it_is_revoked(tmp_path: Path) -> None:
    folder, (robot, secret), (public, ours) = KeyFolder(tmp_path), make_key_pair(), make_key_pair()
    folder.write_pair("robot", robot, secret)
    with (
        DriverPort(EPHEMERAL, "--arm", LIMIT_BYTES, keys=RobotKeys.load(tmp_path)) as port,
        zmq.Context() as context,
        driver(context, port, b"stranger") as stranger,
        context.socket(zmq.DEALER) as part,
    ):
        stranger.send(b"let me in")
        part.setsockopt(zmq.LINGER, 0)
        OperatorKeys(ours, robot).secure(part)
        part.connect(port.endpoint)
        told: list[str] = []
        for _ in range(_ROUNDS):
            port.wait(0.01)
            if told := refreshed(port):
                break
        assert told == [f"refused an unknown key; to let it in: {folder.command(f'allow NAME {public} --role driver')}"]
        folder.allow("driver", public, "driver")
        assert refreshed(port) == []
        # ZeroMQ does not retry a refused connection.
        part.disconnect(port.endpoint)
        part.connect(port.endpoint)
        part.send(b"state")
        assert [payload for _, payload in heard(port)] == [b"state"]
        folder.revoke("driver")
        refreshed(port)
        part.send(b"state")
        for _ in range(_ROUNDS):
            port.wait(0.01)
            assert port.receive() == []
            if port.revoked:
                return
        pytest.fail("it is let in still")


def test_an_operators_key_does_not_drive_the_arm_and_a_changed_role_counts_at_once(tmp_path: Path) -> None:
    folder, (robot, secret), (public, ours) = KeyFolder(tmp_path), make_key_pair(), make_key_pair()
    folder.write_pair("robot", robot, secret)
    folder.allow("anna", public)
    with (
        DriverPort(EPHEMERAL, "--arm", LIMIT_BYTES, keys=RobotKeys.load(tmp_path)) as port,
        zmq.Context() as context,
        context.socket(zmq.DEALER) as part,
    ):
        part.setsockopt(zmq.LINGER, 0)
        OperatorKeys(ours, robot).secure(part)
        part.connect(port.endpoint)
        part.send(b"state")
        for _ in range(_ROUNDS):
            port.wait(0.01)
            assert port.receive() == []
            if told := refreshed(port):
                break
        assert told == ["refused anna, whose role is operator, where driver is let in (feelahead keys allow --help)"]
        folder.allow("anna", public, "driver")
        refreshed(port)
        part.disconnect(port.endpoint)
        part.connect(port.endpoint)
        part.send(b"state")
        assert [payload for _, payload in heard(port)] == [b"state"]
        folder.allow("anna", public, "observer")
        refreshed(port)
        for _ in range(_ROUNDS):
            part.send(b"state")
            port.wait(0.01)
            assert port.receive() == []
            if port.revoked:
                return
        pytest.fail("it drives still")
