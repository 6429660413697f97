"""Our end of the door, in virtual time: what it does when its companion ends, hangs, or cannot begin."""

import socket
from collections.abc import Iterator
from typing import Self, cast

import msgspec
import pytest

from common.clock import VirtualClock
from common.companion.channel import Channel
from common.companion.process import Companion
from common.errors import ConfigurationError
from common.sockets.door.client import RETRY_S, SILENT_S, Door
from common.sockets.door.messages import (
    Asked,
    DoorSettings,
    DriverSettings,
    Failed,
    Figures,
    FromDriver,
    FromPeer,
    Listening,
    Owner,
    Ready,
    Said,
    decode_asked,
    encode,
)
from common.sockets.tcp_figures import TcpFigures

SETTINGS = DoorSettings(
    "tcp://127.0.0.1:0", drivers={"--arm": DriverSettings("tcp://127.0.0.1:0", "driver", 4096, 1e6)}
)
BOUND = Ready({"--arm": "tcp://127.0.0.1:5002"}, [])
AT = Listening("tcp://127.0.0.1:5000", "tcp://127.0.0.1:5001")


class Keeper:
    """Stand-in for a companion: the test speaks through `other`."""

    def __init__(self, text: str, *says: Said) -> None:
        ours, theirs = socket.socketpair()
        self.channel, self.other = Channel(ours), Channel(theirs)
        self.settings = msgspec.json.decode(text, type=DoorSettings)
        self.code = -6
        self.closed: list[float] = []
        self.say(*says)

    def say(self, *said: Said) -> None:
        for one in said:
            self.other.send(encode(one))

    def heard(self) -> list[Asked]:
        return [decode_asked(payload) for payload in self.other.receive()]

    def close(self, limit_s: float = 2.0) -> bool:
        self.closed.append(limit_s)
        self.channel.close()
        self.other.close()
        return True


class Run:
    """Door in virtual time, with the companions that it has started and what it said to people."""

    def __init__(self, *says: Said) -> None:
        self.says: tuple[Said, ...] = says
        self.clock, self.notes, self.keepers = VirtualClock(), list[str](), list[Keeper]()
        self.door = Door(SETTINGS, self.notes.append, clock=self.clock, start=self.start)

    def start(self, text: str) -> Companion:
        self.keepers.append(Keeper(text, *self.says))
        return cast(Companion, self.keepers[-1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for keeper in self.keepers:
            keeper.close()

    def pass_time(self, seconds: float, step_s: float = 0.1) -> None:
        for _ in range(round(seconds / step_s)):
            self.clock.advance_to(self.clock.now() + step_s)
            self.door.update()


@pytest.fixture
def run() -> Iterator[Run]:
    with Run(BOUND, AT) as opened:
        opened.door.ready()
        assert opened.door.listen() == AT
        yield opened


def figures(count: int, busiest: str = "") -> Figures:
    return Figures({"unread": count}, TcpFigures(), [], [], busiest)


def test_messages_come_from_their_ports(run: Run) -> None:
    run.keepers[0].say(FromPeer(b"anna", b"forth"), FromDriver("--arm", b"arm", b"state", 0.5))
    run.keepers[0].say(FromPeer(b"bob", b"back"))
    assert run.door.receive() == [(b"anna", b"forth"), (b"bob", b"back")]
    assert run.door.receive() == []
    assert run.door.ports["--arm"].receive() == [(b"arm", b"state", 0.5)]
    assert run.door.ports["--arm"].endpoint == "tcp://127.0.0.1:5002"


def test_one_that_ends_is_replaced_at_the_same_addresses_and_the_line_says_who_sent_most(run: Run) -> None:
    run.door.own(b"anna")
    run.clock.advance_to(10.0)
    run.keepers[-1].say(figures(3, "mallory at 10.0.0.3:5123, 9000 kB/s"))
    run.door.update()
    before = len(run.keepers)
    run.keepers[-1].other.close()
    run.door.update()
    run.door.update()
    assert len(run.keepers) == before + 1
    again = run.keepers[-1].settings
    assert (again.bind, again.view_bind, again.listens) == (AT.control, AT.view, True)
    assert again.drivers["--arm"].bind == "tcp://127.0.0.1:5002"
    assert run.notes[-1] == (
        "the process that owns the ports ended (SIGABRT); another one is started, and peers connect again"
        "; most came from mallory at 10.0.0.3:5123, 9000 kB/s"
    )
    assert Owner(b"anna") in run.keepers[-1].heard()
    run.keepers[-1].say(figures(2))
    run.door.update()
    assert run.door.counts() == {"unread": 5}  # Counts of both.


def test_one_that_ends_soon_is_replaced_a_little_later(run: Run) -> None:
    run.keepers[0].other.close()
    run.pass_time(0.9 * RETRY_S, 0.05)
    assert len(run.keepers) == 1
    run.pass_time(0.2 * RETRY_S + 0.1, 0.05)
    assert len(run.keepers) == 2
    assert run.door.restarts == 1


def test_one_that_hangs_is_ended_but_our_own_pause_is_none_of_its_silence(run: Run) -> None:
    for _ in range(3):
        run.clock.advance_to(run.clock.now() + 2.0 * SILENT_S)  # We were stopped.
        run.door.update()
    assert run.door.restarts == 0
    run.pass_time(SILENT_S + 0.2)
    assert run.door.restarts == 1
    assert "hung" in run.notes[-1]


def test_what_it_cannot_bind_is_our_error_only_before_it_has_listened(run: Run) -> None:
    failed = Failed("--bind: cannot bind tcp://127.0.0.1:5000")
    with Run(failed) as failing, pytest.raises(ConfigurationError, match="--bind: cannot bind"):
        failing.door.ready()
    run.says = (failed,)
    run.keepers[0].other.close()
    for _ in range(5):
        run.pass_time(RETRY_S + 0.1, 0.05)
        run.keepers[-1].other.close()
    run.says = (BOUND, AT)
    run.pass_time(2.0 * RETRY_S + 0.2, 0.05)
    assert len(run.keepers) > 5
    assert len(run.notes) == 1
    run.keepers[-1].say(FromPeer(b"anna", b"again"))
    assert run.door.receive() == [(b"anna", b"again")]


def test_one_that_ends_before_it_was_ready_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Keeper, "say", lambda keeper: keeper.other.close())
    with Run() as failing, pytest.raises(ConfigurationError, match="ended while it started"):
        failing.door.ready()


def test_the_end_takes_the_last_figures(run: Run) -> None:
    keeper = run.keepers[0]
    keeper.say(figures(7))
    keeper.other.flush()
    keeper.other.close()
    run.door.close()
    run.door.close()
    assert run.door.counts() == {"unread": 7}
    assert len(run.keepers) == 1
    assert len(keeper.closed) == 1
    assert run.door.send(b"anna", b"late") is False
