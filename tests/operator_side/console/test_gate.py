"""Who is let in: nobody without the token, from another site, or by another name."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.datastructures import Headers

from operator_side.console.gate import LIVE, SCENE, Gate

TOKEN, PORT = "a-secret_Token", 4711
HERE = f"127.0.0.1:{PORT}"
GATE = Gate(TOKEN, PORT)


def admits(path: str, host: str | None = HERE, origin: str | None = None, *, upgrade: bool = False) -> str | None:
    headers = Headers()
    for name, value in (("Host", host), ("Origin", origin), ("Upgrade", "websocket" if upgrade else None)):
        if value is not None:
            headers[name] = value
    return GATE.admits(path, headers)


@pytest.mark.parametrize("host", [HERE, f"localhost:{PORT}"])
def test_who_has_the_token_is_let_in_by_either_name(host: str) -> None:
    origin = f"http://{host}"
    assert admits(f"/{TOKEN}/", host) == "/"
    assert admits(f"/{TOKEN}/app.js?x=1", host, origin) == "/app.js"
    assert admits(f"/{TOKEN}/scene/", host) == "/scene/"
    assert admits(f"/{TOKEN}/live", host, origin, upgrade=True) == LIVE
    assert admits(f"/{TOKEN}/scene", host, origin, upgrade=True) == SCENE


@pytest.mark.parametrize("host", [None, "", "example.com", f"example.com:{PORT}", "127.0.0.1", f"127.0.0.1:{PORT + 1}"])
def test_another_name_for_this_machine_is_refused(host: str | None) -> None:
    # A site whose name suddenly means this machine would else share our origin.
    assert admits(f"/{TOKEN}/", host) is None


@pytest.mark.parametrize(
    "origin", ["http://example.com", f"https://{HERE}", "null", f"http://localhost:{PORT}", "http://127.0.0.1", ""]
)
def test_another_site_is_refused(origin: str) -> None:
    assert admits(f"/{TOKEN}/", origin=origin) is None
    assert admits(f"/{TOKEN}/live", origin=origin, upgrade=True) is None


@pytest.mark.parametrize("place", ["live", "scene"])
def test_a_socket_says_where_it_comes_from_and_is_nothing_else(place: str) -> None:
    assert admits(f"/{TOKEN}/{place}", upgrade=True) is None
    assert admits(f"/{TOKEN}/{place}") is None
    assert admits(f"/{TOKEN}/", origin=f"http://{HERE}", upgrade=True) is None
    assert admits(f"/{TOKEN}/scene/", origin=f"http://{HERE}", upgrade=True) is None


def test_two_hosts_or_two_origins_are_refused() -> None:
    for name, value in (("Host", "example.com"), ("Host", HERE), ("Origin", f"http://{HERE}")):
        headers = Headers([("Host", HERE), ("Origin", f"http://{HERE}"), ("Upgrade", "websocket"), (name, value)])
        assert GATE.admits(f"/{TOKEN}/live", headers) is None


@pytest.mark.parametrize(
    "path",
    [
        "",
        "/",
        "*",
        "//",
        f"/{TOKEN}",
        f"/{TOKEN}?/",
        f"/?{TOKEN}/",
        f"{TOKEN}/",
        f"//{TOKEN}/",
        f"/./{TOKEN}/",
        f"/x/../{TOKEN}/",
        f"/{TOKEN} /",
        f"/{TOKEN.upper()}/",
        f"/{TOKEN[:-1]}/",
        f"/{TOKEN}x/",
        f"/{TOKEN.replace('-', '%2d')}/",
        f"http://{HERE}/{TOKEN}/",
        "/\udcff\udcfe/",
    ],
)
def test_no_trick_with_the_path_stands_for_the_token(path: str) -> None:
    assert admits(path) is None


@given(st.text())
def test_no_other_path_is_let_in(path: str) -> None:
    assert admits(path) is None
    assert admits(f"/{path}") is None


@given(st.text().filter(lambda rest: "?" not in rest))
def test_what_follows_the_token_is_left_as_it_is(rest: str) -> None:
    place = admits(f"/{TOKEN}/{rest}")
    assert place == (None if f"/{rest}" in (LIVE, SCENE) else f"/{rest}")


def test_only_the_scene_may_run_what_is_in_its_page_and_be_framed_by_ours() -> None:
    ours, scene = GATE.headers("/"), GATE.headers("/scene/")
    assert "unsafe" not in ours["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in ours["Content-Security-Policy"]
    assert f"frame-ancestors http://127.0.0.1:{PORT} http://localhost:{PORT}" in scene["Content-Security-Policy"]
    for headers in (ours, scene):
        policy = headers["Content-Security-Policy"].split()
        assert not [word for word in policy if word in ("*", "ws:", "http:", "https:")]
        assert (headers["Referrer-Policy"], headers["Cache-Control"]) == ("no-referrer", "no-store")
