import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.datastructures import Headers

from operator_side.viewing.console.gate import LIVE, SCENE, Gate

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
def test_the_token_opens_the_gate_by_either_name(host: str) -> None:
    origin = f"http://{host}"
    assert admits(f"/{TOKEN}/", host) == "/"
    assert admits(f"/{TOKEN}/app.js?x=1", host, origin) == "/app.js"
    assert admits(f"/{TOKEN}/scene/", host) == "/scene/"
    assert admits(f"/{TOKEN}/live", host, origin, upgrade=True) == LIVE
    assert admits(f"/{TOKEN}/scene", host, origin, upgrade=True) == SCENE


OTHER_HOSTS = (None, "", "example.com", f"example.com:{PORT}", "127.0.0.1", f"127.0.0.1:{PORT + 1}")
"""Values of the header Host to refuse. A site whose name resolves to this machine would send its own name"""
OTHER_SITES = ("http://example.com", f"https://{HERE}", "null", f"http://localhost:{PORT}", "http://127.0.0.1", "")
OURS = f"http://{HERE}"


@pytest.mark.parametrize(
    ("place", "host", "origin", "upgrade"),
    [
        *(("", host, None, False) for host in OTHER_HOSTS),
        *(("", HERE, site, False) for site in OTHER_SITES),
        *(("live", HERE, site, True) for site in OTHER_SITES),
        *((place, HERE, None, upgrade) for place in ("live", "scene") for upgrade in (False, True)),
        *(("", HERE, OURS, True), ("scene/", HERE, OURS, True)),
    ],
)
def test_another_name_or_site_or_way_in_is_refused(
    place: str, host: str | None, origin: str | None, upgrade: bool
) -> None:
    assert admits(f"/{TOKEN}/{place}", host, origin, upgrade=upgrade) is None


def test_two_hosts_or_two_origins_are_refused() -> None:
    for name, value in (("Host", "example.com"), ("Host", HERE), ("Origin", f"http://{HERE}")):
        headers = Headers([("Host", HERE), ("Origin", f"http://{HERE}"), ("Upgrade", "websocket"), (name, value)])
        assert GATE.admits(f"/{TOKEN}/live", headers) is None


NO_TOKEN = ("", "/", "*", "//", f"/{TOKEN}", f"/{TOKEN}?/", f"/?{TOKEN}/", f"{TOKEN}/", f"//{TOKEN}/", f"/./{TOKEN}/")
TRICKS = (f"/x/../{TOKEN}/", f"/{TOKEN} /", f"/{TOKEN.upper()}/", f"/{TOKEN[:-1]}/", f"/{TOKEN}x/", "/\udcff\udcfe/")
ENCODED = (f"/{TOKEN.replace('-', '%2d')}/", f"{OURS}/{TOKEN}/")


@pytest.mark.parametrize("path", [*NO_TOKEN, *TRICKS, *ENCODED])
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


def test_our_page_reaches_no_other_server_but_the_one_to_which_it_goes_back() -> None:
    gate = Gate(TOKEN, PORT)
    before = gate.headers("/")["Content-Security-Policy"]
    gate.back = "http://127.0.0.1:4712"
    after = gate.headers("/")["Content-Security-Policy"]
    assert after.replace(f" {gate.back};", ";") == before != after
    assert gate.headers("/scene/") == GATE.headers("/scene/")
