import asyncio
import contextlib
import os
import signal
import socket
import struct
import urllib.error
import urllib.request
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
import numpy as np
import pytest
import viser
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from common.clock import MonotonicClock
from common.extras import installing
from common.protocol.codec import encode
from common.protocol.messages import Header
from common.protocol.view_messages import VIEW_NAMES, VideoStep
from operator_side.viewing.console.console import Console
from operator_side.viewing.console.pages import ROUND_ENDS
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.repository import ROOT
from tests.operator_side.console_feed import OBJECTS, Feed

pytestmark = pytest.mark.processes
CLOCK = MonotonicClock()


@pytest.fixture(scope="module")
def started() -> Iterator[Console]:
    with Console("a test") as console:
        until(console, lambda: console.address is not None)
        yield console
        port = urlsplit(address_of(console)).port
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port or 0))


@pytest.fixture
def console(started: Console) -> Console:
    until(started, lambda: started.pages == 0)
    started.words.clear()
    return started


def until(console: Console, so: Callable[[], bool], feed: Feed | None = None) -> None:
    end_s = CLOCK.now() + LIMIT_S
    while not so():
        assert CLOCK.now() < end_s, console.take_notes()
        step(console, feed)


def step(console: Console, feed: Feed | None) -> None:
    if feed is None:
        console.receive(CLOCK.now())
    else:
        feed.step(CLOCK.now())


def address_of(console: Console) -> str:
    assert console.address is not None
    return console.address


def status_of(address: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:  # noqa: S310
            return int(answer.status)
    except urllib.error.HTTPError as refused:
        return refused.code


def page(console: Console, place: str = "live") -> connect:
    address = address_of(console)
    protocols = [Subprotocol(f"viser-v{viser.__version__}")] if place == "scene" else None
    ours = Origin("http://" + urlsplit(address).netloc)
    return connect(address.replace("http", "ws") + place, origin=ours, subprotocols=protocols)


@contextlib.asynccontextmanager
async def fed(console: Console, feed: Feed | None = None) -> AsyncIterator[None]:
    """Feed the console, for LIMIT_S at most, during the context."""

    async def feeds() -> None:
        while not ends.is_set():
            step(console, feed)
            await asyncio.sleep(0.002)

    ends = asyncio.Event()
    feeding = asyncio.create_task(feeds())
    async with asyncio.timeout(LIMIT_S):
        yield
    ends.set()
    await feeding


async def heard(console: Console) -> dict[str, Any]:
    """Wait for a page's words, and return them; pages that close are passed over."""
    while True:
        while console.words:
            if (said := console.words.popleft()[1]) is not None:
                return said
        await asyncio.sleep(0.002)


def test_steps_become_pictures_and_a_gap_is_told(console: Console) -> None:
    pytest.importorskip("av", reason="needs the extra `video`")
    from robot_side.viewing.h264 import H264  # noqa: PLC0415  # only now it is known to be there

    encoder, gray = H264(), np.full((48, 64, 3), 128, np.uint8)

    def picture(*, whole: bool = False) -> bytes:
        content, is_whole = encoder.encode(gray, 75, whole=whole)
        place = Header(1, 2, 3.0), "first_person", 1.5, 64, 48
        return encode(VideoStep(*place, encoder.number, is_whole, content))  # type: ignore[arg-type]

    async def story() -> None:
        async with fed(console), page(console) as opened:
            while console.pages == 0 or console.lacks is None:
                await asyncio.sleep(0.002)
            assert console.lacks == (0, 0)
            for lost, whole, lacks in ((False, False, 0), (True, False, 0), (False, False, 3), (False, True, 0)):
                payload = picture(whole=whole)
                if lost:
                    continue
                console.view(payload, video=True)
                while console.lacks != (0, lacks):
                    await asyncio.sleep(0.002)
                while lacks == 0:
                    message = await opened.recv()
                    if message == ROUND_ENDS:
                        await opened.send('{"taken":true}')
                    elif isinstance(message, bytes):
                        assert struct.unpack_from("<Bd", message) == (1, 1.5)
                        assert message[9:11] == b"\xff\xd8"
                        break

    asyncio.run(story())


def test_it_outlives_ctrl_c_and_its_gate_keeps_strangers_out(console: Console) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        os.kill(console._companion.process_id, number)
    address = address_of(console)
    parts = urlsplit(address)
    here, token = f"http://{parts.netloc}", parts.path.strip("/")
    assert (parts.hostname, len(token) >= 32) == ("127.0.0.1", True)
    assert [status_of(address + place) for place in ("", "app.js", "style.css", "scene/")] == [200] * 4
    tricks = ("../scene/", "live", "gate.py", "..%2fgate.py", "scene/..%2f..%2f_viser.py")
    assert {status_of(place) for place in (f"{here}/", *(address + trick for trick in tricks))} == {404}
    assert status_of(address, Host="example.com") == status_of(address + "scene/", Host="example.com") == 404


def test_pages_get_facts_pictures_and_the_scene_as_they_are_fed(console: Console) -> None:
    async def watch(opened: ClientConnection) -> tuple[Counter[str], dict[str, object]]:
        counts: Counter[str] = Counter()
        newest: dict[str, object] = {}
        # More of each than come in a second.
        while min(counts[kind] for kind in ("facts", "scene", *VIEW_NAMES)) < 12:
            message = await opened.recv()
            if isinstance(message, bytes):
                view, _ = struct.unpack_from("<Bd", message)
                counts[VIEW_NAMES[view]] += 1
                assert message[9:11] == b"\xff\xd8"
            else:
                said = msgspec.json.decode(message)
                counts[said["kind"]] += 1
                newest[said["kind"]] = said
                if message == ROUND_ENDS:
                    await opened.send('{"taken":true}')
        return counts, newest

    async def story() -> None:
        async with fed(console, Feed(console)), page(console) as first, page(console) as second:
            for counts, newest in await asyncio.gather(watch(first), watch(second)):
                assert counts["run"] == 1
                facts, scene = newest["facts"], newest["scene"]
                assert isinstance(facts, dict)
                assert isinstance(scene, dict)
                assert (facts["said"]["state"], facts["said"]["why"]) == ("ARMED", ["advancing", None])
                assert (facts["said"]["whose"], facts["said"]["holding"]) == ("scripted person", "nothing")
                assert facts["facts"]["advancing"] == "R2"
                assert {row["name"] for row in scene["objects"]} <= set(OBJECTS)
            assert console.pages == 2
            await first.send('{"hands": {"Space": true}}')
            assert await heard(console) == {"hands": {"Space": True}}

    asyncio.run(story())


def test_a_console_that_is_killed_releases_hands_and_comes_back_at_its_address_a_few_times() -> None:
    async def story(console: Console) -> None:
        async with fed(console), page(console) as first, page(console):
            await first.send('{"hands": {"Space": true}}')
            assert await heard(console) == {"hands": {"Space": True}}
            os.kill(console._companion.process_id, signal.SIGKILL)
            while console.address is not None:
                await asyncio.sleep(0.002)

    async def come_back(console: Console) -> None:
        async with fed(console), page(console) as opened:
            messages = [str(await opened.recv()) for _ in range(3)]
            assert {msgspec.json.decode(message)["kind"] for message in messages} == {"run", "note", "end"}

    def killed(console: Console, at_s: float) -> list[str]:
        os.kill(console._companion.process_id, signal.SIGKILL)
        while not (notes := console.take_notes()):
            console.receive(at_s)
        return notes

    with Console("a test") as console:
        until(console, lambda: console.address is not None)
        console.note("said before")
        before = address_of(console)
        asyncio.run(story(console))
        again = ["the console has ended; it is started again, and no page drives meanwhile"]
        assert (list(console.words), console.pages, console.take_notes()) == ([(1, None)], 0, again)
        until(console, lambda: console.address is not None)
        assert address_of(console) == before
        asyncio.run(come_back(console))
        first_id, now_s = console._companion.process_id, CLOCK.now()
        assert urlsplit(before).path.strip("/") not in Path(f"/proc/{first_id}/cmdline").read_text()
        for k in (1, 2):
            assert killed(console, now_s + k) == again
            while console._companion.process_id == first_id:
                console.receive(now_s + k + 1.0)
            first_id = console._companion.process_id
        assert killed(console, now_s + 4.0) == ["the console has ended; the run continues without it"]
        feed = Feed(console)
        for _ in range(100):
            feed.step(now_s + 5.0)
        assert (console.gone, console.take_notes(), console.pages, console.address) == (True, [], 0, None)


def test_a_message_that_is_too_large_ends_its_page_alone(console: Console) -> None:
    async def story() -> None:
        async with fed(console), page(console) as greedy, page(console) as modest:
            await greedy.send('{"hands": {"x": "' + "x" * 100_000 + '"}}')
            await greedy.wait_closed()
            assert greedy.close_code == 1009
            await modest.send('{"tune": {"probability": 0.5}}')
            assert await heard(console) == {"tune": {"probability": 0.5}}

    asyncio.run(story())


def notes_of(console: Console) -> list[str]:
    with console:
        until(console, lambda: console.gone)
        return console.take_notes()


def test_a_port_that_is_taken_is_said() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        notes = notes_of(Console("a test", port=port))
    said = f"no console: --console-port {port}: Address already in use; valid: a free port, or 0 to choose one"
    assert notes == [said]


@pytest.mark.parametrize(
    ("module", "note"),
    [
        (
            "raise ModuleNotFoundError('No module', name='viser')",
            f"no console: viser is not installed; to install it: {installing('operator')}",
        ),
        (
            # As another version of viser, which opens its server differently, would do.
            "class ViserServer:\n    def __init__(self, **options): pass\n    def get_port(self): return 1\n"
            "SceneApi = BatchedMeshHandle = LabelHandle = None",
            "no console: viser has another version, which opens its server in another way; valid: viser 1.1",
        ),
    ],
)
def test_without_the_viser_that_we_know_there_is_none_which_is_said(
    module: str, note: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "viser").mkdir()
    (tmp_path / "viser" / "__init__.py").write_text(module)
    (tmp_path / "viser" / "transforms.py").write_text("SO3 = None")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    assert notes_of(Console("a test")) == [note]
