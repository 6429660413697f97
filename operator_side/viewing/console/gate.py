"""Access to the console. Any web site can reach a local port, so address, token and origin must be right.

http://127.0.0.1:PORT/TOKEN/        our page
http://127.0.0.1:PORT/TOKEN/live    its WebSocket
http://127.0.0.1:PORT/TOKEN/scene/  viser's page, and its WebSocket
"""

import hmac
from collections.abc import Sequence
from typing import Final, Protocol

LIVE: Final = "/live"
SCENE: Final = "/scene"
SOCKETS: Final = (LIVE, SCENE)
"""Places that are WebSockets, and nothing else"""


class Headers(Protocol):
    """Headers as of `websockets`."""

    def get_all(self, key: str) -> Sequence[str]:
        """Return every value of a header, by its name in any case."""


class Gate:
    """Judge of requests; it gives no reason for a refusal."""

    def __init__(self, token: str, port: int) -> None:
        self.address = f"http://127.0.0.1:{port}/{token}/"
        """Address of the page; it admits anyone who knows it."""
        self._token = token.encode("ascii")
        self._hosts = (f"127.0.0.1:{port}", f"localhost:{port}")

    def admits(self, path: str, headers: Headers) -> str | None:
        """Return the place in the console of a request for `path`, from `/` on and without a query; None to refuse.

        A WebSocket must come from a page of ours, by its Origin; a page may come without one.
        """
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        upgrade = bool(headers.get_all("Upgrade"))
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return None
        if list(origins) != [f"http://{hosts[0]}"] and (upgrade or origins):
            return None
        token, slash, rest = path.partition("?")[0].removeprefix("/").partition("/")
        right = hmac.compare_digest(token.encode("utf-8", "replace"), self._token)
        if not right or not slash or not path.startswith("/"):
            return None
        place = f"/{rest}"
        return place if (place in SOCKETS) is upgrade else None

    def headers(self, place: str) -> dict[str, str]:
        """Return the headers of an answer for `place`: no caching, no foreign frames, no foreign sources.

        viser's page is one file that unpacks itself, and starts a worker of WebAssembly. Our page embeds it by the
        other of our two names, as another site: the browser then isolates it in a separate process, without access to
        ours.
        """
        sockets = " ".join(f"ws://{host}" for host in self._hosts)
        sites = " ".join(f"http://{host}" for host in self._hosts)
        scene = place.startswith(f"{SCENE}/")
        policy = (
            f"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob:;"
            f" style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:;"
            f" connect-src 'self' data: blob: {sockets}"
            if scene
            else f"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:;"
            f" frame-src {sites}; connect-src 'self' {sockets}"
        )
        ancestors, framing = (sites, {}) if scene else ("'none'", {"X-Frame-Options": "DENY"})
        return framing | {
            "Content-Security-Policy": f"{policy}; frame-ancestors {ancestors}; base-uri 'none'; form-action 'none'",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "cross-origin" if scene else "same-origin",
            "Cache-Control": "no-store",
        }
