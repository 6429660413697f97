"""Check of the gate by real requests, because another version of viser may open its server in a way that avoids it."""

import http.client
from collections.abc import Mapping
from typing import Final

_LIMIT_S: Final = 5.0
_UPGRADE: Final = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def prove(port: int, token: str) -> str | None:
    """Send requests to the server on `port` of this machine; describe the first answer against the gate's rules.

    None if all answers are right. OSError if the server does not answer.
    """
    here = f"127.0.0.1:{port}"
    ours, foreign = {"Origin": f"http://{here}"}, {"Origin": "http://example.com"}
    for place in ("", "app.js", "live", "scene", "scene/", "scene/index.html"):
        upgrade = _UPGRADE if place in ("live", "scene") else {}
        refused: list[tuple[str, str, Mapping[str, str]]] = [
            ("without the token", f"/{place}", ours),
            ("with another token", f"/{'x' * len(token)}/{place}", ours),
            ("from another origin", f"/{token}/{place}", foreign),
            ("for another host", f"/{token}/{place}", {**ours, "Host": f"example.com:{port}"}),
        ]
        if upgrade:
            refused.append(("without an origin", f"/{token}/{place}", {}))
        for how, path, headers in refused:
            if (status := _status(port, path, {"Host": here} | dict(headers) | upgrade)) < http.client.BAD_REQUEST:
                return f"/{place} {how} is answered with {status}"
    for place in ("", "scene/"):
        if (status := _status(port, f"/{token}/{place}", {"Host": here})) != http.client.OK:
            return f"/{place} with the token is answered with {status}"
    return None


def _status(port: int, path: str, headers: Mapping[str, str]) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=_LIMIT_S)
    try:
        connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()
