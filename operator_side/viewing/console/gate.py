"""Access check for the console. Any web site can send requests to a local port, so the token, Host and Origin are
checked.

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
"""Paths below the token that are WebSockets; all other paths are files"""


class Headers(Protocol):
    """HTTP headers, with the interface of `websockets`."""

    def get_all(self, key: str) -> Sequence[str]:
        """Return all values of the header `key`, in upper or lower case."""


class Gate:
    """Admits or refuses requests; gives no reason for a refusal."""

    def __init__(self, token: str, port: int) -> None:
        self.address = f"http://127.0.0.1:{port}/{token}/"
        """Address of the page, with the token: whoever knows it is admitted."""
        self.back = ""
        """Origin of the server to which our page goes at the end: the page may ask whether it answers"""
        self._token = token.encode("ascii")
        self._hosts = (f"127.0.0.1:{port}", f"localhost:{port}")

    def admits(self, path: str, headers: Headers) -> str | None:
        """Return the part of `path` after the token, from its `/` on and without the query; None to refuse the request.

        A WebSocket needs the Origin of our page; other requests may lack an Origin.
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
        """Return the headers of an answer for `place`: no caching, no framing by other sites, no foreign content.

        viser's page is one file that unpacks itself and starts a WebAssembly worker, so its policy permits more. Our
        page embeds it under the other of our two host names (127.0.0.1, localhost), so that the browser treats it as
        another site: it runs in its own process, without access to our page.
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
            f" frame-src {sites}; connect-src 'self' {sockets} {self.back}".rstrip()
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
