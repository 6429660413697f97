"""When the demo ends, by its pages or its duration, and that its address survives a restart; without processes."""

import json
import re
import socket
import sys
from contextlib import closing, suppress
from pathlib import Path
from typing import cast

import pytest
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from common.command.status import Status
from common.sockets.robot import RobotSockets
from common.status.statuses import OperatorStatus
from feelahead.both_sides.processes import SideProcess
from feelahead.commands.demo.page import AFTER_PAGES_S, FIRST_PAGE_S, KeptPage, Lifetime, kept_addresses
from feelahead.commands.demo.run import Said, Start, take_events
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.operator_side.viewing.terminal.on_terminal import OnTerminal


def ends_at(lifetime: Lifetime, pages: dict[float, int], limit_s: float = 500.0) -> tuple[float, str]:
    """Return when and why the run ends. pages: number of open pages, by the time from which on it holds."""
    lifetime.begin(0.0)
    now_s, open_now = 0.0, 0
    while now_s < limit_s:
        open_now = pages.get(now_s, open_now)
        if (why := lifetime.why_over(open_now, now_s)) is not None:
            return now_s, why
        now_s += 0.5
    raise AssertionError("it goes on")


def test_a_duration_wins_over_pages() -> None:
    assert ends_at(Lifetime(20.0), {0.0: 1}) == (20.0, "the run ends after 20 s")


def test_without_a_page_it_ends_after_a_minute_and_says_what_makes_it_longer() -> None:
    at_s, why = ends_at(Lifetime(None), {})
    assert at_s == FIRST_PAGE_S
    assert "--duration" in why


@pytest.mark.parametrize("closed_s", [10.0, 59.0, 300.0])
def test_it_goes_on_while_a_page_is_open_and_ends_after_the_last_one_closed(closed_s: float) -> None:
    pages = {2.0: 1, 4.0: 2, 6.0: 1, closed_s: 0}
    # The page was seen open for the last time one step before.
    assert ends_at(Lifetime(None), pages) == (closed_s - 0.5 + AFTER_PAGES_S, "the page was closed: the run ends")


def test_a_reload_does_not_end_it() -> None:
    assert ends_at(Lifetime(None), {2.0: 1, 50.0: 0, 53.0: 1, 100.0: 0})[0] > 100.0


def test_it_does_not_end_before_the_link_was_up() -> None:
    lifetime = Lifetime(1.0)
    assert lifetime.why_over(0, 1e6) is None
    assert not lifetime.has_begun


def test_a_page_finds_the_next_run_at_the_same_address(tmp_path: Path) -> None:
    page = KeptPage(tmp_path)
    token, waits = page.flags(waits=True)
    path = Path(token.removeprefix("--console-token="))
    secret = path.read_text()
    assert (len(secret) >= 24, path.stat().st_mode & 0o077) == (True, 0)
    assert waits.startswith("--person-waits=")
    assert page.is_new("http://127.0.0.1:4321/secret/")
    assert page.flags(waits=True) == [token, waits, "--console-port=4321"]
    assert page.flags(waits=False) == [token, "--console-port=4321"], "who asked for a duration gets it whole"
    assert not page.is_new("http://127.0.0.1:4321/secret/")
    assert path.read_text() == secret
    page.wants_again = True
    assert [page.take_again(), page.take_again()] == [True, False]


def test_the_robot_side_gets_the_addresses_that_are_kept_from_others() -> None:
    with kept_addresses("control", "view") as kept:
        with socket.socket() as other, pytest.raises(OSError, match="in use"):
            other.bind(("127.0.0.1", int(kept["control"].rpartition(":")[2])))
        with closing(RobotSockets(kept["control"], kept["view"])) as robot:
            assert kept == {"control": robot.control_endpoint, "view": robot.view_endpoint}


def opened(address: str) -> Connection:
    """Open the page's connection, again and again until the console serves it."""

    def tried() -> Connection | None:
        with suppress(OSError, WebSocketException):
            return connect(
                address.replace("http", "ws", 1) + "live",
                origin=Origin(re.sub(r"/[^/]*/$", "", address)),
                max_size=None,
            )
        return None

    page = wait_until("a console", tried, LIMIT_S)
    page.send(json.dumps({"slow": True, "looks": True}))
    return page


def read_until(page: Connection, kind: str) -> dict[str, object]:
    while True:
        content = page.recv(timeout=LIMIT_S)
        message: dict[str, object] = json.loads(content) if isinstance(content, str) else {"kind": "picture"}
        if message["kind"] == "end":
            page.send(json.dumps({"taken": True}))
        if message["kind"] == kind:
            return message


def test_a_page_that_opens_and_closes_between_two_looks_has_been_open() -> None:
    class Side:
        name = "operator"

        def events(self) -> list[dict[str, object]]:
            return [{"event": "pages", "count": count} for count in (1, 0)]

    said = Said()
    take_events(cast(SideProcess, Side()), said, Status("none", "demo"), None)
    assert [said.pages_since(), said.pages_since()] == [1, 0]


def test_a_start_takes_as_long_as_the_robot_side_goes_on_reporting_and_a_link_half_a_minute() -> None:
    class Side:
        name = "robot"

        def events(self) -> list[dict[str, object]]:
            return [{"event": "note", "text": "compiling"}]

    said, start, silent = Said(operator=OperatorStatus()), Start("delay 1s", 0.0), Start("", 0.0)
    for now_s in range(0, 4000, 100):
        take_events(cast(SideProcess, Side()), said, Status("none", "demo"), None)
        assert start.trouble(said, float(now_s)) is None
    assert silent.trouble(Said(operator=OperatorStatus()), 600.0) is None
    assert "said nothing for 600 s" in (silent.trouble(Said(operator=OperatorStatus()), 601.0) or "")
    said.listens = True
    assert [start.trouble(said, now_s) for now_s in (5000.0, 5030.0)] == [None, None]
    assert "--link 'delay 1s'" in (start.trouble(said, 5031.0) or "")


@pytest.mark.processes
def test_a_page_keeps_the_demo_alive_and_runs_it_again_at_the_same_address() -> None:
    demo = OnTerminal([sys.executable, "-P", "-m", "feelahead", "demo"])
    address = re.compile(rb"http://127\.0\.0\.1:\d+/[\w-]+/")
    try:
        demo.read_until(lambda seen: address.search(seen.replace(b"\r\n", b"")))
        found = address.search(demo.seen.replace(b"\r\n", b""))
        assert found is not None
        with opened(found[0].decode()) as page:
            assert read_until(page, "run")["may_run_again"] is True
            page.send(json.dumps({"again": True}))
            assert read_until(page, "ended") == {"kind": "ended"}
            with pytest.raises(ConnectionClosed):
                read_until(page, "nothing more")
        with opened(found[0].decode()) as page:
            read_until(page, "run")
        assert demo.end() == 0
    finally:
        demo.close()
