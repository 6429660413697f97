"""Server of a study's two pages on this machine, each behind a gate of its own, in a thread of its own."""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from importlib import resources
from queue import Empty, SimpleQueue
from typing import Any, Final, NamedTuple, Self, get_args

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from common.errors import ConfigurationError
from feelahead.study.room import Page
from operator_side.viewing.console.gate import LIVE, Gate

PAGES: Final[tuple[Page, ...]] = get_args(Page)
_LARGEST_MESSAGE: Final = 1 << 14
_MOST_OPEN: Final = 8
"""Maximum number of open pages of each kind"""
_TYPES: Final = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}


class Said(NamedTuple):
    """Message of a page."""

    page: Page
    content: Mapping[str, Any]
    answer: Callable[[str], None]
    """Sends that page alone why its message was refused; an empty text if it was not"""


class PageServer:
    """Both pages. Each shows the newest state that it was given, also when it is opened or reloaded."""

    def __init__(self, port: int, tokens: Mapping[Page, str]) -> None:
        """port: of 127.0.0.1; 0 for any free one. ConfigurationError if it is taken."""
        self._part = socket.socket()
        self._part.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._part.bind(("127.0.0.1", port))
        except OSError as error:
            self._part.close()
            raise ConfigurationError(f"port {port}: {error.strerror}; valid: a free port") from error
        self.port = int(self._part.getsockname()[1])
        self._gates = {page: Gate(tokens[page], self.port) for page in PAGES}
        self._files = _files()
        self._heard: SimpleQueue[Said] = SimpleQueue()
        self._states: dict[Page, str] = {}
        self._open: dict[Page, dict[ServerConnection, asyncio.Event]] = {page: {} for page in PAGES}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._end: asyncio.Event | None = None
        self._began = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._began.wait()
        return self

    def __exit__(self, *_: object) -> None:
        if self._loop is not None and self._end is not None:
            self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()
        self._part.close()

    def address(self, page: Page) -> str:
        """Return the address of a page; whoever knows it is admitted."""
        return self._gates[page].address

    def is_open(self, page: Page) -> bool:
        """Return whether somebody has the page open."""
        return bool(self._open[page])

    def heard(self) -> list[Said]:
        """Return the messages of the pages since the last call."""
        found = []
        with contextlib.suppress(Empty):
            while True:
                found.append(self._heard.get_nowait())
        return found

    def show(self, page: Page, state: Mapping[str, Any]) -> None:
        """Show a state; nothing is sent as long as it is the same."""
        text = json.dumps({"state": state})
        if text != self._states.get(page) and self._loop is not None:
            self._states[page] = text
            self._loop.call_soon_threadsafe(self._wake, page)

    def _wake(self, page: Page) -> None:
        for changed in self._open[page].values():
            changed.set()

    async def _run(self) -> None:
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        options: dict[str, Any] = {"max_size": _LARGEST_MESSAGE, "ping_interval": 5, "ping_timeout": 5}
        options |= {"close_timeout": 0.5, "server_header": None}
        async with serve(self._serve, sock=self._part, process_request=self._answer, **options):
            self._began.set()
            await self._end.wait()

    def _admitted(self, request: Request) -> tuple[Page, str] | None:
        for page, gate in self._gates.items():
            if (place := gate.admits(request.path, request.headers)) is not None:
                return page, place
        return None

    def _answer(self, _: ServerConnection, request: Request) -> Response | None:
        page, place = self._admitted(request) or (None, "")
        if place == LIVE:
            return None
        name = f"/{page}.html" if place == "/" else place
        if page is None or name not in self._files or (name.endswith(".html") and place != "/"):
            return Response(HTTPStatus.NOT_FOUND, "Not Found", Headers({"Content-Length": "0", "Connection": "close"}))
        content_type, body = self._files[name]
        headers = {"Content-Type": content_type, "Content-Length": str(len(body)), "Connection": "close"}
        return Response(HTTPStatus.OK, "OK", Headers(headers | self._gates[page].headers(place)), body)

    async def _serve(self, connection: ServerConnection) -> None:
        admitted = None if connection.request is None else self._admitted(connection.request)
        if admitted is None or len(self._open[admitted[0]]) >= _MOST_OPEN:
            return
        page, changed = admitted[0], asyncio.Event()
        changed.set()
        self._open[page][connection] = changed
        sending = asyncio.create_task(self._send(page, connection, changed))
        try:
            with contextlib.suppress(ConnectionClosed):
                async for message in connection:
                    self._hear(page, message, connection)
        finally:
            sending.cancel()
            del self._open[page][connection]

    async def _send(self, page: Page, connection: ServerConnection, changed: asyncio.Event) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await changed.wait()
                changed.clear()
                if page in self._states:
                    await connection.send(self._states[page])

    def _hear(self, page: Page, message: str | bytes, connection: ServerConnection) -> None:
        def answer(text: str) -> None:
            if self._loop is not None:
                asyncio.run_coroutine_threadsafe(_tell(connection, text), self._loop)

        try:
            content = json.loads(message)
        except (ValueError, RecursionError):
            content = None
        if isinstance(content, dict):
            self._heard.put(Said(page, content, answer))


async def _tell(connection: ServerConnection, text: str) -> None:
    with contextlib.suppress(ConnectionClosed):
        await connection.send(json.dumps({"refused": text}))


def _files() -> dict[str, tuple[str, bytes]]:
    folder = resources.files("feelahead.commands.study") / "page"
    return {
        f"/{file.name}": (f"{_TYPES[suffix]}; charset=utf-8", file.read_bytes())
        for file in folder.iterdir()
        if (suffix := file.name[file.name.rfind(".") :]) in _TYPES
    }
