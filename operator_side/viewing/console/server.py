"""Server of the page and of viser's scene, with the gate in front of both.

viser opens its server with one call of `websockets.asyncio.server.serve`. During that call a function of ours replaces
`serve`. It passes our socket, which only this machine can reach, and our check of each request, so that only admitted
requests reach viser. `proof.py` tests this with real requests.
"""

import asyncio
import contextlib
import socket
from collections.abc import Awaitable, Callable, Iterator, Mapping
from http import HTTPStatus
from importlib import resources
from typing import Any, Final

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from operator_side.viewing.console.gate import LIVE, SCENE, SOCKETS, Gate
from operator_side.viewing.console.names import names
from operator_side.viewing.console.pages import MOST_PAGES, Pages

_LARGEST_MESSAGE: Final = 1 << 16
"""Maximum size of a page's message, in bytes; pages send only inputs, and viser's camera"""
_PING_S: Final = 5.0
"""Seconds between pings, and until a page that does not answer one is closed"""
_CLOSE_S: Final = 0.5
"""Seconds to wait for a page's part in closing a WebSocket; one closed for sending too much may go on sending"""
_TYPES: Final[Mapping[str, str]] = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
}
_HIDES_PANEL: Final = b"<style>.mantine-Paper-root, .mantine-Notification-root { display: none !important }</style>"

Handler = Callable[[ServerConnection], Awaitable[None]]
ProcessRequest = Callable[[ServerConnection, Request], Response | None]


class Viser(viser.ViserServer):
    """viser's server, without the public tunnel to the scene that viser opens when a page requests it."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse to open a public tunnel."""
        del verbose
        return None


def read_page() -> dict[str, tuple[str, bytes]]:
    """Return content type and content of the page's files and of names.js, keyed by their paths below the token."""
    folder = resources.files("operator_side.viewing.console") / "page"
    files = {
        f"/{file.name}": (_TYPES[file.name[file.name.rindex(".") :]], file.read_bytes())
        for file in folder.iterdir()
        if file.name.endswith(tuple(_TYPES))
    }
    return files | {"/": files["/index.html"], "/names.js": (_TYPES[".js"], names().encode())}


class Server:
    """viser's server behind the gate. Our pages are served in the event loop of viser's thread, `loop`."""

    def __init__(self, gate: Gate, pages: Pages, part: socket.socket) -> None:
        """part: a bound socket to listen on. RuntimeError if viser does not open its server as viser 1.1 does."""
        self._gate = gate
        self._pages = pages
        self._part = part
        self._files = read_page()
        self._scenes = 0
        self.loop: asyncio.AbstractEventLoop | None = None
        with self._in_between():
            self.viser = Viser(host="127.0.0.1", port=part.getsockname()[1], verbose=False)
        if self.loop is None or self.viser.get_port() != part.getsockname()[1]:
            raise RuntimeError("this viser opens its server in another way than viser 1.1 does")

    @contextlib.contextmanager
    def _in_between(self) -> Iterator[None]:
        opens = websockets.asyncio.server.serve

        def serve(handler: Handler, *_: object, process_request: ProcessRequest, **options: Any) -> Any:
            self.loop = asyncio.get_running_loop()
            options |= {"max_size": _LARGEST_MESSAGE, "ping_interval": _PING_S, "ping_timeout": _PING_S}
            options |= {"close_timeout": _CLOSE_S, "server_header": None}

            async def handle(connection: ServerConnection) -> None:
                request = connection.request
                place = None if request is None else self._gate.admits(request.path, request.headers)
                if place == LIVE:
                    await self._pages.serve(connection)
                elif place == SCENE and self._scenes < MOST_PAGES:
                    self._scenes += 1
                    try:
                        await handler(connection)
                    finally:
                        self._scenes -= 1

            def answer(connection: ServerConnection, request: Request) -> Response | None:
                return self._answer(connection, request, process_request)

            return opens(handle, sock=self._part, process_request=answer, **options)

        websockets.asyncio.server.serve = serve  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = opens  # type: ignore[misc]

    def _answer(self, connection: ServerConnection, request: Request, visers: ProcessRequest) -> Response | None:
        """Return the HTTP answer to a request; None for an admitted WebSocket, whose handshake then continues."""
        place = self._gate.admits(request.path, request.headers)
        if place in SOCKETS:
            return None
        if place is not None and place.startswith(f"{SCENE}/"):
            headers = Headers(Host=request.headers["Host"])  # without gzip
            response = visers(connection, Request(place.removeprefix(SCENE), headers))
            if response is not None and response.status_code == HTTPStatus.OK:
                body = bytes(response.body).replace(b"</head>", _HIDES_PANEL + b"</head>", 1)
                return self._file(place, response.headers["Content-Type"], body)
        elif place in self._files:
            return self._file(place, *self._files[place])
        return Response(HTTPStatus.NOT_FOUND, "Not Found", Headers({"Content-Length": "0", "Connection": "close"}))

    def _file(self, place: str, content_type: str, body: bytes) -> Response:
        headers = {"Content-Type": content_type, "Content-Length": str(len(body)), "Connection": "close"}
        return Response(HTTPStatus.OK, "OK", Headers(headers | self._gate.headers(place)), body)
