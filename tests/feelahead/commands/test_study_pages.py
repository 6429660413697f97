"""Server of a study's pages, and the sides of a trial."""

import http.client
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from common.errors import ConfigurationError
from feelahead.commands.study.server import PAGES, PageServer, Said
from feelahead.commands.study.sides import Desk, TrialSides
from feelahead.study.protocol import Condition
from feelahead.study.room import Page, Seen
from feelahead.study.schedule import Planned
from feelahead.study.session import Start
from tests.helpers.machines.waiting import wait_until

TOKENS: dict[Page, str] = {"experimenter": "e" * 32, "participant": "p" * 32}


@pytest.fixture(name="server")
def served() -> Iterator[PageServer]:
    with PageServer(0, TOKENS) as server:
        yield server


def opened(server: PageServer, page: Page, origin: str | None = None) -> ClientConnection:
    here = f"http://127.0.0.1:{server.port}"
    return connect(f"ws://127.0.0.1:{server.port}/{TOKENS[page]}/live", origin=origin or here)  # type: ignore[arg-type]


def heard(server: PageServer) -> Said:
    found: list[Said] = []

    def came() -> bool:
        found.extend(server.heard())
        return bool(found)

    wait_until("a message", came)
    return found[0]


def test_each_page_has_its_own_address_and_no_other_program_gets_in(server: PageServer) -> None:
    def get(path: str, host: str | None = None) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
        connection.request("GET", path, headers={} if host is None else {"Host": host})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content

    for page in PAGES:
        path = urlsplit(server.address(page)).path
        assert f'<body class="{page}">'.encode() in get(path)[1]
        for name in ("style.css", "shared.js", f"{page}.js"):
            assert get(f"{path}{name}")[0] == 200
        for wrong in (f"{path}../pages.json", f"{path}{page}.html", "/", f"/{'x' * 32}/", f"{path}live"):
            assert get(wrong)[0] == 404
        assert get(path, "example.com")[0] == 404
        with pytest.raises(InvalidStatus):
            opened(server, page, "http://example.com")


def test_a_page_shows_the_newest_state_also_after_a_reload(server: PageServer) -> None:
    server.show("participant", {"step": "rest"})
    server.show("experimenter", {"step": "other"})
    for _ in range(2):
        with opened(server, "participant") as page:
            assert json.loads(page.recv(10)) == {"state": {"step": "rest"}}
            wait_until("open", lambda: server.is_open("participant"))
            server.show("participant", {"step": "rest"})
            with pytest.raises(TimeoutError):
                page.recv(0.3)
    assert not server.is_open("experimenter")


def test_a_refusal_is_told_to_who_asked(server: PageServer) -> None:
    with opened(server, "experimenter") as one, opened(server, "experimenter") as other:
        one.send("no JSON")
        one.send("[1]")
        one.send('{"event": "begun"}')
        said = heard(server)
        assert (said.page, said.content) == ("experimenter", {"event": "begun"})
        said.answer("not now")
        assert json.loads(one.recv(10)) == {"refused": "not now"}
        with pytest.raises(TimeoutError):
            other.recv(0.3)


def test_a_port_that_is_taken_is_named(server: PageServer) -> None:
    with pytest.raises(ConfigurationError, match=f"port {server.port}: .*; valid: a free port"):
        PageServer(server.port, TOKENS)


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    found = Desk("browser", tmp_path, tmp_path / "sides.log")
    found.token.write_text("t" * 32)
    found.back.write_text("http://127.0.0.1:1/back/")
    return found


def see(sides: TrialSides, what: str, holds: Callable[[Seen], object]) -> Seen:
    seen = Seen()

    def looked() -> bool:
        nonlocal seen
        seen = sides.look(time.monotonic())
        return bool(holds(seen))

    wait_until(what, looked, 120.0)
    return seen


@pytest.mark.processes
@pytest.mark.parametrize(
    ("killed", "words"),
    [("operator", "the operator side was lost"), ("recorder", "the recorder was lost"), (None, None)],
)
def test_sides_of_a_trial_from_their_start_to_their_end(desk: Desk, killed: str | None, words: str | None) -> None:
    planned = Planned(1, 1, "margin", 50.0, "wall", 1, 7)
    recording = desk.folder / "unfinished-p01-t001.mcap"
    sides = TrialSides(Start(planned, Condition(law="margin", margin_m=0.03), recording), desk, 0)
    with ThreadPoolExecutor(1) as pool:
        try:
            seen = see(sides, "both sides up", lambda seen: seen.side == "up" and seen.console)
            assert (seen.failed, seen.armed, seen.placed) == (None, False, False)
            if killed is not None:
                os.kill(sides.process_ids[killed], signal.SIGKILL)
                seen = see(sides, "a fault", lambda seen: seen.failed)
            assert seen.failed == words
        finally:
            error = sides.close(pool).result()
    assert error == (words if killed == "recorder" else None)
    assert recording.stat().st_size > 0
    assert desk.log.exists() is (killed is not None)


@pytest.mark.processes
def test_a_recorder_that_cannot_start_is_said(desk: Desk) -> None:
    planned = Planned(1, 1, "off", 0.0, "wall", 1, 7)
    desk.log.write_text("")
    with pytest.raises(ConfigurationError, match="--record"):
        TrialSides(Start(planned, Condition(), desk.folder / "none" / "one.mcap"), desk, 0)
