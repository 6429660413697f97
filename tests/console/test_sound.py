"""Sound of the page, rendered by the browser: off until it is switched on, one tone a trigger, a click."""

from typing import Any, Final

import pytest

from tests.console.browser import Browser
from tests.console.hands_alone import served

pytestmark = [pytest.mark.console, pytest.mark.processes]

_RATE_HZ: Final = 8000
_LISTENED: Final = """async ([state, before, after]) => {
    const { Sound } = await import("/sound.js");
    const context = new OfflineAudioContext(2, 8000, 8000);
    let made = 0;
    const button = document.createElement("button");
    const sound = new Sound(button, () => { made += 1; return context; });
    const facts = ({ l2, r2, stands }) => {
        const trigger = (strength) => ({ meets: 0, zones: [0, 0, 0, 0, strength, 8, 8, 8, 8, 8] });
        return { status: { state, stands }, l2: trigger(l2), r2: trigger(r2) };
    };
    sound.play(facts(before), [0.31, 0.31]);
    const silent = made;
    button.click();
    sound.play(facts(after), [0.31, 0.31]);
    const heard = await context.startRendering();
    const [left, right] = [0, 1].map((channel) => {
        const samples = [...heard.getChannelData(channel).slice(800, 2400)];
        const crossings = samples.filter((value, k) => k && (value > 0) !== (samples[k - 1] > 0)).length;
        return [Math.max(...samples), crossings / 0.4];
    });
    const clicks = Math.max(...heard.getChannelData(0).slice(0, 400));
    const late = Math.max(...heard.getChannelData(1).slice(6400));
    return { silent, pressed: button.ariaPressed, left, right, clicks, late };
}"""
_NOTHING: Final = {"l2": 0, "r2": 0, "stands": False}


def _heard(browser: Browser, after: dict[str, Any], state: str = "armed", before: dict[str, Any] = _NOTHING) -> Any:
    with served() as address, browser.page(address) as page:
        return page.ask(_LISTENED, [state, before, _NOTHING | after])


def test_each_trigger_has_its_tone_and_its_side_as_loud_as_it_is_stiff_ahead(browser: Browser) -> None:
    """In the zone of the finger, 3, nothing resists; it is the next one that does."""
    full, half = _heard(browser, {"l2": 8, "r2": 4}), _heard(browser, {"r2": 2})
    assert (full["silent"], full["pressed"]) == (0, "true")
    (left, low_hz), (right, high_hz) = full["left"], full["right"]
    assert low_hz == pytest.approx(330.0, abs=10.0)
    assert high_hz == pytest.approx(660.0, abs=10.0)
    assert (left, right) == (pytest.approx(0.25, rel=0.15), pytest.approx(0.125, rel=0.15))
    assert half["left"][0] < 1e-6
    assert half["right"][0] == pytest.approx(0.0625, rel=0.15)
    assert full["late"] < 1e-3, "it sounds on without news"
    assert _heard(browser, {"r2": 8}, state="disarmed")["right"][0] < 1e-6


def test_a_click_says_that_what_is_held_came_to_stand(browser: Browser) -> None:
    stands = _NOTHING | {"stands": True}
    assert _heard(browser, stands)["clicks"] > 0.05
    assert _heard(browser, stands, before=stands)["clicks"] < 1e-6
