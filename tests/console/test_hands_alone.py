"""Keys, pointer and gamepad of the page by themselves, in virtual time: what pulls the triggers, what releases them."""

from collections.abc import Callable, Iterable, Mapping
from typing import Final

import pytest

from tests.console.browser import Browser
from tests.console.hands_alone import HandsAlone, hands_alone

pytestmark = [pytest.mark.console, pytest.mark.processes]


_BUTTONS: Final = 17
_AXES: Final = (0.0, 0.0, 0.0, 0.0)


def test_keys_ramp_up_and_let_go_at_once(browser: Browser) -> None:
    """Space arms and is hold-to-run. W pulls R2 to the chosen level within 0.6 s; its release frees R2 at once."""
    with hands_alone(browser) as alone:
        alone.run()
        keyboard = alone.page.raw.keyboard
        keyboard.press("Digit9")
        keyboard.down("KeyW")
        alone.let_pass(0.3)
        half = alone.pulled[1]
        alone.let_pass(0.4)
        full = alone.pulled[1]
        assert _keyed(alone)
        keyboard.up("KeyW")
        alone.let_pass(0.04)
        after = alone.pulled[1]
        assert 0.35 < half < 0.65
        assert full > 0.97
        assert after == 0.0
        assert alone.runs, "hold-to-run was let go with it"
        keyboard.press("Digit3")
        keyboard.down("ArrowDown")
        alone.let_pass(0.7)
        assert abs(alone.pulled[0] - 3 / 9) < 0.01
        assert alone.pulled[1] == 0.0
        keyboard.up("Space")
        alone.let_pass(0.04)
        assert (alone.pulled, alone.runs) == ((0.0, 0.0), False)


def test_every_key_does_what_it_says(browser: Browser) -> None:
    """Each key, by its place on the keyboard, changes the input that the page names for it, and no other."""
    with hands_alone(browser) as alone:
        alone.run()
        keyboard = alone.page.raw.keyboard
        expected = {
            "KeyW": ("r2", 1.0), "ArrowUp": ("r2", 1.0), "KeyS": ("l2", 1.0), "ArrowDown": ("l2", 1.0),
            "KeyA": ("lateral", (-1.0, 0.0)), "KeyD": ("lateral", (1.0, 0.0)),
            "KeyR": ("lateral", (0.0, 1.0)), "KeyF": ("lateral", (0.0, -1.0)),
            "KeyQ": ("turning", (-1.0, 0.0)), "KeyE": ("turning", (1.0, 0.0)),
            "ArrowLeft": ("turning", (-1.0, 0.0)), "ArrowRight": ("turning", (1.0, 0.0)),
            "KeyI": ("turning", (0.0, 1.0)), "KeyK": ("turning", (0.0, -1.0)),
            "KeyC": ("gripper", 1), "KeyO": ("gripper", -1), "KeyT": ("next_target", True), "KeyH": ("hand_over", True),
            "KeyV": ("next_speed", True), "KeyG": ("next_frame", True), "KeyP": ("home", 1.0),
        }  # fmt: skip
        keyboard.press("Digit9")
        for code, (name, value) in expected.items():
            keyboard.down(code)
            alone.let_pass(0.7)
            intent = alone.intent
            keyboard.up(code)
            alone.let_pass(0.04)
            assert intent is not None, "no report came"
            meant = getattr(intent, name)
            pairs = zip(_parts(meant), _parts(value), strict=True)
            assert all(abs(a - b) < 0.02 for a, b in pairs)
            moved = {
                part for part in ("l2", "r2", "lateral", "turning", "gripper") if any(_parts(getattr(intent, part)))
            }
            assert moved <= {name}


def _marks(alone: HandsAlone) -> list[str]:
    return [message["mark"] for message in alone.messages if "mark" in message]


@pytest.mark.parametrize("may_drive", [True, False])
def test_a_gamepads_directional_pad_marks_as_a_dualsense_does(browser: Browser, may_drive: bool) -> None:
    """Each press is one mark. A controller that the operator side reads itself marks there, and not here."""
    with hands_alone(browser, may_drive=may_drive) as alone:
        for button in (12, 15, 14, 13, 11):
            held = [0.0] * _BUTTONS
            held[button] = 1.0
            alone.page.pretend_gamepad(_AXES, tuple(held))
            alone.let_pass(0.1)
            alone.page.pretend_gamepad(_AXES, (0.0,) * _BUTTONS)
            alone.let_pass(0.04)
        expected = ["start", "success", "failure", "discard", "reset"]
        assert _marks(alone) == (expected if may_drive else [])


def test_keys_mark_episodes_in_any_state_and_drive_nothing(browser: Browser) -> None:
    """Each press is one mark, also of a page that only watches; hold-to-run goes on beside it."""
    marks = "window.sent.map(([, text]) => JSON.parse(text).mark).filter((mark) => mark)"
    with hands_alone(browser) as alone:
        keyboard = alone.page.raw.keyboard
        keyboard.press("KeyN")
        assert alone.page.ask(marks) == ["start"]
        alone.run()
        alone.page.ask("window.sent.splice(0)")
        for code in ("KeyY", "KeyM", "KeyU", "KeyB"):
            keyboard.press(code)
        assert alone.page.ask(marks) == ["success", "failure", "discard", "reset"]
        alone.let_pass(0.1)
        assert alone.runs


def _keyed(alone: HandsAlone) -> bool:
    return bool(alone.messages[-1]["hands"]["keyed"])


def _parts(value: object) -> tuple[float, ...]:
    return tuple(map(float, value)) if isinstance(value, Iterable) else (float(value),)  # type: ignore[arg-type]


def _freeze(alone: HandsAlone) -> None:
    alone.hears = False
    alone.let_pass(0.35)
    alone.hears = True


ENDS: Final[Mapping[str, Callable[[HandsAlone], object]]] = {
    "a lost focus": lambda alone: alone.page.blur(),
    "a hidden tab": lambda alone: alone.page.hide(),
    "a left page": lambda alone: alone.page.ask("window.dispatchEvent(new Event('pagehide'))"),
    "a field": lambda alone: alone.page.raw.focus("#field"),
    "the scene": lambda alone: alone.page.raw.click("#scene"),
    "the browser's own keys": lambda alone: alone.page.raw.keyboard.press("Control+KeyJ"),
    "a stop": lambda alone: alone.page.raw.keyboard.press("Escape"),
    "silence": lambda alone: setattr(alone, "hears", False),
    "a gap": _freeze,
}


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
def test_whatever_takes_the_keys_lets_go(browser: Browser, end: Callable[[HandsAlone], object]) -> None:
    """Keys that are still down no longer count. A key pressed again too soon does not count however long it is held."""
    with hands_alone(browser) as alone:
        alone.run()
        keyboard = alone.page.raw.keyboard
        keyboard.down("KeyW")
        alone.let_pass(0.5)
        assert alone.pulled[1] > 0.2
        end(alone)
        alone.let_pass(0.06 if alone.hears else 0.35)
        assert (alone.pulled, alone.runs) == ((0.0, 0.0), False)
        alone.let_pass(0.3)
        assert not alone.runs, "keys that stayed down were taken for new ones"
        for code in ("KeyW", "Space"):
            keyboard.up(code)
        alone.let_pass(0.5)
        keyboard.down("Space")
        alone.let_pass(1.5)
        assert not alone.runs, "half a second of rest was enough"


def test_driving_begins_on_purpose_and_after_a_rest(browser: Browser) -> None:
    """Keys do nothing before the button is pressed. Enter presses it. Keys that are down then delay the driving."""
    with hands_alone(browser) as alone:
        keyboard = alone.page.raw.keyboard
        keyboard.down("Space")
        keyboard.down("KeyW")
        alone.let_pass(1.5)
        assert alone.messages == []
        alone.page.raw.focus("#drive")
        keyboard.press("Enter")
        alone.let_pass(0.6)
        alone.expect("Release all keys")
        assert alone.page.text("#hands_rest") == "still 1.0 s", "the second began before the keys were up"
        keyboard.up("KeyW")
        keyboard.up("Space")
        keyboard.down("KeyW")
        alone.let_pass(2.0)
        alone.expect("Release all keys")
        assert not alone.runs, "it ran without a rest"
        keyboard.up("KeyW")
        alone.let_pass(0.62)
        assert alone.page.text("#hands_rest") == "still 0.4 s"
        alone.let_pass(0.58)
        alone.expect("Ready")
        alone.page.raw.focus("#other")
        keyboard.down("Space")
        alone.let_pass(0.2)
        assert (alone.runs, alone.page.ask("window.clicked")) == (True, 0), "Space pressed a button instead"
        keyboard.up("Space")
        assert alone.page.ask("window.clicked") == 0, "Space pressed a button when it came up"
        alone.page.raw.click("#drive")
        alone.let_pass(0.06)
        assert alone.pages.driver is None, "it still drives"


def test_escape_is_sent_until_it_is_confirmed(browser: Browser) -> None:
    """Esc works even in a text field and for an observer. The page sends the stop until the arm's state confirms it."""
    with hands_alone(browser) as alone:
        alone.page.raw.focus("#field")
        alone.facts = {"status": {"state": "armed", "link": "up", "owner": "armed"}}
        alone.page.raw.keyboard.press("Escape")
        alone.let_pass(1.0)
        stops = [message["hands"]["stop"] for message in alone.messages]
        assert len(stops) >= 45
        assert all(stops)
        assert "not confirmed" in alone.page.text("#hands_stopped"), alone.page.text("#hands_stopped")
        alone.facts = {}
        alone.let_pass(0.1)
        assert "STOPPED" in alone.page.text("#hands_stopped"), alone.page.text("#hands_stopped")
        before = len(alone.messages)
        alone.let_pass(0.5)
        assert len(alone.messages) <= before + 1
        assert not alone.messages[-1]["hands"]["stop"]
        alone.facts = {"status": {"state": "armed", "link": "up", "owner": "observing"}}
        alone.page.raw.click("#stop")
        alone.let_pass(0.1)
        assert "Only the owner" in alone.page.text("#hands_stopped"), alone.page.text("#hands_stopped")


def test_pointer_and_gamepad_drive(browser: Browser) -> None:
    """A pointer pulls by dragging; a gamepad's travel is taken as it is. Both release at once."""
    with hands_alone(browser) as alone:
        alone.drive()
        mouse, box = alone.page.raw.mouse, alone.page.raw.locator("#grip_advance").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        mouse.move(x, y)
        mouse.down()
        alone.let_pass(0.2)
        alone.expect("You drive")
        mouse.move(x, y - 45)
        alone.let_pass(0.06)
        dragged = alone.pulled[1]
        assert abs(dragged - 0.5) < 0.05
        mouse.up()
        alone.let_pass(0.06)
        assert (alone.pulled, alone.runs) == ((0.0, 0.0), False)
        alone.page.pretend_gamepad(_AXES, (0.0,) * _BUTTONS)
        alone.let_pass(1.3)
        held = [0.0] * _BUTTONS
        held[4] = 1.0
        alone.page.pretend_gamepad(_AXES, tuple(held))
        alone.let_pass(0.2)
        held[7] = 0.62
        alone.page.pretend_gamepad((0.0, 0.0, 0.0, -1.0), tuple(held))
        alone.let_pass(0.06)
        assert alone.intent is not None
        assert abs(alone.pulled[1] - 0.6) < 0.01
        assert not _keyed(alone), "a finger's pull yields by itself"
        assert alone.intent.turning[1] > 0.97
        held[1] = 1.0
        alone.page.pretend_gamepad(_AXES, tuple(held))
        alone.let_pass(0.06)
        assert (alone.state, alone.runs) == ("stopped", False)


def test_what_cannot_be_done_is_said(browser: Browser) -> None:
    """The page says in words that a real controller or another page drives, or that tuning is not permitted."""
    with hands_alone(browser, may_drive=False) as alone:
        alone.expect("A real controller drives")
        assert alone.page.ask("document.getElementById('drive').disabled"), "the button can be pressed"
        alone.facts = {"may_tune": False}
        alone.let_pass(0.06)
        assert "--permit-tuning" in alone.page.text("#tuning_reason"), alone.page.text("#tuning_reason")
        assert alone.page.ask("document.querySelectorAll('#tuning input:disabled').length") == 4, "sliders move"
    with hands_alone(browser, person=True) as alone:
        other = {"page": "another", "number": 0, "driving": True}
        alone.pages.receive(2, {"hands": other}, alone.now_ms / 1000)
        alone.let_pass(0.06)
        alone.expect("Another page drives")
        alone.let_pass(0.3)
        alone.drive()
        assert alone.page.raw.is_visible("#give_back"), "the person cannot go on"
        alone.page.raw.click("#give_back")
        alone.let_pass(0.06)
        assert alone.pages.driver is None, "it still drives"
        given = [message["hands"]["give_back"] for message in alone.messages]
        assert given.count(True) == 1
        assert given[-1] is False


def test_sliders_tune(browser: Browser) -> None:
    """Keys move the sliders. The wish is sent once they rest, and the page shows the present value beside it."""
    with hands_alone(browser) as alone:
        keyboard = alone.page.raw.keyboard
        alone.let_pass(2.5)
        assert "0.99" in alone.page.text("#tune_probability_now"), alone.page.text("#tune_probability_now")
        alone.page.raw.focus("#tune_probability")
        keyboard.press("ArrowLeft")
        keyboard.press("ArrowLeft")
        alone.let_pass(0.4)
        alone.page.raw.focus("#tune_delay")
        for _ in range(4):
            keyboard.press("ArrowRight")
        alone.page.raw.focus("#tune_loss")
        keyboard.press("ArrowRight")
        alone.let_pass(0.4)
        wishes = [message["tune"] for message in alone.messages if "tune" in message]
        assert wishes == [{"probability": 0.95}, {"link": "delay 20ms loss 0.5%"}]
        assert "the run has" in alone.page.text("#tune_delay_now"), alone.page.text("#tune_delay_now")
        asked = {"asked": "delay 20ms 4ms distribution normal loss 0.5%"}
        alone.facts = {"probability": 0.95, "to_robot": asked}
        alone.let_pass(2.5)
        shown = [alone.page.text(f"#tune_{name}_now") for name in ("probability", "delay", "jitter", "loss")]
        assert shown == ["0.95", "20 ms", "4 ms", "0.5 %"]
