"""A turn asks ZeroMQ's sockets for messages only a few times, and overlooks none. Nothing here sleeps."""

import select
from collections.abc import Iterator
from typing import Any

import pytest
import zmq

from common.sockets import inbox as inbox_module
from common.sockets.inbox import Inbox
from common.sockets.readable import readable as readable_now
from tests.helpers.socket_talk import PATIENT_S


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """List to which each socket is added when it is asked for EVENTS."""
    those: list[Any] = []
    really = readable_now

    def readable(part: Any) -> bool:
        those.append(part)
        return really(part)

    monkeypatch.setattr(inbox_module, "readable", readable)
    return those


@pytest.fixture
def pair() -> Iterator[tuple["zmq.Socket[bytes]", "zmq.Socket[bytes]"]]:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    ours, theirs = context.socket(zmq.PAIR), context.socket(zmq.PAIR)
    ours.bind("tcp://127.0.0.1:*")
    theirs.connect(ours.getsockopt_string(zmq.LAST_ENDPOINT))
    yield ours, theirs
    context.destroy(linger=0)


def signal_of(inbox: Inbox) -> bool:
    return bool(select.select([inbox.descriptor], [], [], PATIENT_S)[0])


def test_an_empty_socket_is_asked_once(pair: tuple["zmq.Socket[bytes]", "zmq.Socket[bytes]"], asked: list[Any]) -> None:
    inbox = Inbox(pair[0], frames=1)
    pair[1].send(b"hello")
    assert signal_of(inbox)
    while not inbox.has_some():
        assert signal_of(inbox)
    assert [[frame.bytes for frame in message] for message in inbox.read()] == [[b"hello"]]
    asked.clear()
    assert not any(inbox.has_some() for _ in range(100))
    assert asked == []


def test_a_signal_that_another_use_took_is_no_message_lost(
    pair: tuple["zmq.Socket[bytes]", "zmq.Socket[bytes]"],
) -> None:
    ours, theirs = pair
    inbox = Inbox(ours, frames=1)
    theirs.send(b"first")
    while not inbox.has_some():
        assert signal_of(inbox)
    list(inbox.read())
    theirs.send(b"second")
    assert signal_of(inbox)
    while not int(ours.getsockopt(zmq.EVENTS)) & zmq.POLLIN:  # As sending does.
        assert signal_of(inbox)
    assert not inbox.has_some(), "nothing signals any more: without `used` it is overlooked"
    inbox.used()
    assert inbox.has_some()
    assert [frame.bytes for message in inbox.read() for frame in message] == [b"second"]
