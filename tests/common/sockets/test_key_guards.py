"""Each guard of the keys and of the open port, disabled: the test that covers it must then fail."""

import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from common.sockets import inbox, shell
from common.sockets.allow_list import AllowList
from common.sockets.authentication import Authenticator, RobotKeys, make_key_pair
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from tests.common.sockets import test_fuzz_port as port
from tests.common.sockets import test_keys as files
from tests.common.sockets import test_keys_on_the_wire as wire
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S

FAILURES = (AssertionError, pytest.fail.Exception)


def let_anybody_in(_: Authenticator, question: list[bytes]) -> list[bytes]:
    return [b"1.0", question[1], b"200", b"", question[6].hex().encode(), b""]


def leave_the_view_open(robot: RobotSockets) -> None:
    if robot._keys is not None:
        robot._keys.allowed.refresh()


def knock_once(operator: OperatorSockets) -> None:
    for _, _, watch in operator._watched:
        watch.look()


WIRE: dict[str, tuple[object, str, object, Callable[[wire.Robot], None]]] = {
    "the answer to a handshake": (
        *(Authenticator, "_answer", let_anybody_in),
        wire.test_an_unknown_key_gets_nothing_and_both_sides_say_what_to_do,
    ),
    "the look at each revocation": (
        *(RobotSockets, "refresh_keys", leave_the_view_open),
        wire.test_a_revoked_key_is_cut_off_from_control_and_view_and_others_see_on,
    ),
    "knocking again": (
        *(OperatorSockets, "_look_after_handshakes", knock_once),
        wire.test_a_key_that_is_allowed_later_gets_in_without_a_restart,
    ),
}


@pytest.mark.parametrize("guard", WIRE)
def test_without_its_guard_on_the_wire_a_test_fails(
    guard: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner, name, instead, test = WIRE[guard]
    monkeypatch.setattr(owner, name, instead)
    monkeypatch.setattr(wire, "LIMIT_S", 2.0)
    public, secret = make_key_pair()
    folder = KeyFolder(tmp_path)
    with RobotSockets(wire.EPHEMERAL, keys=RobotKeys(secret, AllowList(folder))) as sockets, pytest.raises(FAILURES):
        test(wire.Robot(folder, public, sockets))


def test_without_the_look_at_each_message_a_test_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RobotSockets, "_allows", lambda *_: True)
    public, secret = make_key_pair()
    folder = KeyFolder(tmp_path)
    with RobotSockets(wire.EPHEMERAL, keys=RobotKeys(secret, AllowList(folder))) as sockets, pytest.raises(FAILURES):
        wire.test_a_revoked_peer_that_keeps_its_connection_is_dropped_message_by_message(
            wire.Robot(folder, public, sockets), monkeypatch
        )


def test_without_the_look_at_file_modes_a_test_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stat, "S_IMODE", lambda _: 0o600)
    with pytest.raises(FAILURES):
        files.test_a_secret_that_others_may_read_is_refused_with_the_command_that_mends_it(KeyFolder(tmp_path), 0o644)


PORT: dict[str, tuple[object, str, object, Callable[[RobotSockets, OperatorSockets, pytest.MonkeyPatch], None]]] = {
    "hanging up": (
        *(RobotSockets, "_hang_up", lambda *_: None),
        port.test_a_peer_that_floods_is_cut_off_and_the_operator_is_not,
    ),
    "the limit of each call": (
        *(inbox, "MESSAGES_PER_RECEIVE", 10**9),
        lambda robot, operator, _: port.test_a_message_of_too_many_frames_is_dropped_in_bounded_steps(
            robot, operator, 20_000
        ),
    ),
    "the limit of a frame": (
        *(shell, "CONTROL_LIMIT_BYTES", -1),
        lambda robot, operator, _: port.test_a_frame_that_claims_too_much_ends_its_connection_alone(
            robot, operator, 10**6
        ),
    ),
}


@pytest.mark.parametrize("guard", PORT)
def test_without_its_guard_at_the_port_a_test_fails(guard: str, monkeypatch: pytest.MonkeyPatch) -> None:
    owner, name, instead, test = PORT[guard]
    monkeypatch.setattr(owner, name, instead)
    monkeypatch.setattr("feelahead.lab.hostile.raw_zmtp._TIMEOUT_S", 1.0)
    monkeypatch.setattr(port, "ROUNDS", 100)
    with (
        # Heartbeats would end a connection too, only later.
        RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as robot,
        OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator,
    ):
        assert port.is_heard(robot, operator)
        with pytest.raises(FAILURES):
            test(robot, operator, monkeypatch)
