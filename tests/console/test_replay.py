"""The last 20 seconds, played again: by themselves, at times that the test gives; and on the page of a live run."""

from typing import Final

import pytest
from msgspec.structs import replace

from common.status.codes import InputSource
from tests.console.browser import Browser
from tests.console.fed_page import AGE, fed_page
from tests.console.hands_alone import served
from tests.console.run import STATE
from tests.helpers.machines.waiting import wait_until

pytestmark = [pytest.mark.console, pytest.mark.processes]

_ALONE: Final = """async (wishes) => {
    const { Replay } = await import("/replay.js");
    const shown = [];
    const replay = new Replay((kind, data) => shown.push(kind === "facts" ? data : data.byteLength));
    for (let at = 0; at <= 30; at += 1) {
        replay.keep("facts", `f${at}`, 1000 * at);
        replay.keep(0, new ArrayBuffer(at), 1000 * at + 500);
    }
    replay.begin(31000);
    replay.keep("facts", "not kept", 31500);
    return wishes.map(([nowS, wish]) => {
        if (wish) replay.wish(wish, 1000 * nowS); else replay.step(1000 * nowS);
        return [replay.state.at_s, replay.state.paused, shown.splice(0)];
    });
}"""
_LARGE: Final = """async () => {
    const { Replay } = await import("/replay.js");
    const shown = [];
    const replay = new Replay((kind, data) => shown.push(kind));
    for (let kind = 0; kind < 5; kind += 1) replay.keep(kind, new ArrayBuffer(15 << 20), kind);
    replay.begin(5);
    replay.wish({ at_s: 1 }, 5);
    return shown;
}"""


def test_the_last_20_seconds_are_played_at_half_and_quarter_speed(browser: Browser) -> None:
    """Those before 30.5 s, when the newest came; the newest of each kind at each moment."""
    with served() as address, browser.page(address) as page:
        played = page.ask(
            _ALONE,
            [
                (31.0, None),
                (33.0, None),
                (33.0, {"speed": 0.25}),
                (37.0, None),
                (38.0, {"paused": True}),
                (40.0, None),
                (40.0, {"at_s": 1.2}),
                (40.0, {"at_s": 99}),
                (41.0, {"paused": False}),
            ],
        )
        assert played == [
            [0.0, False, [10]],
            [1.0, False, ["f11", 11]],
            [1.0, False, []],
            [2.0, False, ["f12", 12]],
            [2.25, True, []],
            [2.25, True, []],
            [1.2, True, ["f11", 11]],
            [20.0, True, ["f30", 30]],
            [0.0, False, [10]],
        ]
        assert page.ask(_LARGE) == [1, 2, 3, 4]  # of 75 MB the newest 60


def test_a_replay_releases_the_hands_and_leaves_state_and_stop_live(browser: Browser) -> None:
    with fed_page(browser) as (fed, page):
        fed.page = replace(fed.page, driver=None)
        page.raw.click("#drive")
        page.wait("document.querySelector('#driving').dataset.state != 'watching'", "asked to drive")
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'replay'", "marked as a replay")
        page.wait_for_text("#overview .age", "REPLAY, ")
        page.wait_for_text("#hands_state", "You are watching")
        assert page.ask("document.querySelector('#speed').value") == "0.5"
        frames = page.ask("document.querySelector('#first_person').dataset.frames")
        page.wait(f"document.querySelector('#first_person').dataset.frames > {frames}", "pictures played again")
        page.press("Escape")
        wait_until("the stop of the page", lambda: fed.stops)
        fed.state, fed.page = "stopped", replace(fed.page, reset_first=True)
        page.wait(f"{STATE} == 'stopped'", "the live state")
        assert page.ask(AGE) == "replay"
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'fresh'", "live again")
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'replay'", "once more")
        page.raw.click("#drive")
        page.wait(f"{AGE} == 'fresh'", "live as soon as it drives")


def test_nothing_is_played_again_while_a_controller_drives_the_armed_arm(browser: Browser) -> None:
    """Who holds the controller must see what is; nothing here releases it."""
    locked = "document.querySelector('#replay').disabled"
    with fed_page(browser) as (fed, page):
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'replay'", "played again beside a page that drives")
        fed.whose = InputSource.CONTROLLER
        page.wait(f"{AGE} == 'fresh' && {locked}", "live as soon as a controller drives")
        assert page.ask("document.querySelector('#replay').title") == "not while a controller drives the armed arm"
        # As a click that was under way would.
        page.ask("document.querySelector('#replay').onclick()")
        assert not page.ask("document.body.classList.contains('again')")
        fed.state = "disarmed"
        page.wait(f"!{locked}", "allowed again")
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'replay'", "played again beside a disarmed arm")
