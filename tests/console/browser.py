"""Chromium without a screen, and pages in it; every error of a page is kept."""

import base64
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
from PIL import Image

from tests.console.provide import provide_playwright, provided_browser
from tests.helpers.machines.waiting import LIMIT_S, wait_until

_ARGUMENTS: Final = (
    "--no-sandbox",  # Root has no sandbox.
    # Without a graphics processor WebGL is drawn by software. Not the whole page: that would take ten times as long.
    "--enable-unsafe-swiftshader",
    "--force-color-profile=srgb",
)
SMALL: Final = (1280, 720)
LARGE: Final = (1920, 1080)
_LIMIT_MS: Final = 1e3 * LIMIT_S
"""Time limit of one step of the browser in milliseconds"""
_DRAWS_SCENE: Final = "button#drawn[aria-pressed={}]"
_BRIGHTNESS: Final = (0.2126, 0.7152, 0.0722)
_FAKE_GAMEPAD: Final = """
window.pretended = null;
navigator.getGamepads = () => [window.pretended, null, null, null];
"""


class Browser:
    """One browser. Each page has a separate context, as if another person had opened it."""

    def __init__(self, chromium: Any, out: Path) -> None:
        self._chromium = chromium
        self._out = out

    @contextmanager
    def page(
        self,
        address: str,
        size: tuple[int, int] = SMALL,
        *,
        scene: bool = False,
        gamepad: bool = False,
    ) -> Iterator["Page"]:
        """Yield a page that shows `address` in a window of `size`; at the end, fail if the page had any error.

        scene: leave the scene drawn, which takes most of a core without a graphics processor. gamepad: let
        `Page.pretend_gamepad` work.
        """
        context = self._chromium.new_context(viewport={"width": size[0], "height": size[1]})
        context.set_default_timeout(_LIMIT_MS)
        from playwright.sync_api import Error  # noqa: PLC0415  # not part of our environment

        try:
            opened = context.new_page()
            opened.add_init_script(_FAKE_GAMEPAD if gamepad else "")
            page = Page(opened, self._out)
            opened.goto(address)
            if (button := opened.query_selector(_DRAWS_SCENE.format("false" if scene else "true"))) is not None:
                button.click()
            yield page
            assert page.complaints == []
        except Error as error:
            raise AssertionError(f"the browser: {str(error).splitlines()[0]}") from error
        finally:
            context.close()


class Page:
    """A page, as a person uses it. `raw` is Playwright's page, for what this class does not offer."""

    def __init__(self, raw: Any, out: Path) -> None:
        self.raw = raw
        self.complaints: list[str] = []
        """Errors that the page logged or did not catch. A test that expects errors clears this list."""
        self._out = out
        self._tools = raw.context.new_cdp_session(raw)
        raw.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        raw.on("pageerror", lambda error: self.complaints.append(str(error)))

    def text(self, selector: str) -> str:
        return str(self.raw.text_content(selector) or "").strip()

    def ask(self, script: str, argument: object = None) -> Any:
        return self.raw.evaluate(script, argument)

    def wait(self, script: str, what: str, limit_s: float = LIMIT_S) -> None:
        """Wait until a piece of JavaScript is true; AssertionError after `limit_s`. what: its name in this error."""
        # Evaluated from here: the page's policy forbids Playwright's own waiting within the page.
        try:
            wait_until(what, lambda: self._holds(script), limit_s)
        except AssertionError:
            self.picture("unexpected")
            raise

    def _holds(self, script: str) -> bool:
        """Return whether a piece of JavaScript is true; a page that is just left for another one has nothing true."""
        from playwright.sync_api import Error  # noqa: PLC0415  # not part of our environment

        try:
            return bool(self.ask(script))
        except Error as error:
            if "context was destroyed" not in str(error):
                raise
            return False

    def wait_for_text(self, selector: str, words: str, limit_s: float = LIMIT_S) -> None:
        script = f"document.querySelector({selector!r})?.textContent.toLowerCase().includes({words.lower()!r})"
        self.wait(script, f"{words!r} in {selector}", limit_s)

    def pixels(self, selector: str | None = None) -> np.ndarray[Any, np.dtype[np.uint8]]:
        return np.asarray(Image.open(io.BytesIO(self.shot(selector))).convert("RGB"))

    def picture(self, name: str) -> None:
        (self._out / f"{name}.png").write_bytes(self.shot())

    def shot(self, selector: str | None = None) -> bytes:
        """Return a PNG of an element or of the whole page.

        Chromium itself makes the picture: Playwright would wait for fonts, which takes long beside a busy scene.
        """
        clip = {}
        if selector is not None:
            box = self.raw.locator(selector).bounding_box()
            clip = {"clip": {**box, "scale": 1}}
        answer = self._tools.send("Page.captureScreenshot", {"format": "png", **clip})
        return base64.b64decode(answer["data"])

    def press(self, key: str) -> None:
        self.raw.keyboard.press(key)

    @contextmanager
    def held(self, *keys: str) -> Iterator[None]:
        for key in keys:
            self.raw.keyboard.down(key)
        try:
            yield
        finally:
            for key in reversed(keys):
                self.raw.keyboard.up(key)

    def blur(self) -> None:
        self.ask("window.dispatchEvent(new Event('blur'))")

    def hide(self) -> None:
        self.ask(
            """() => {
            Object.defineProperty(document, 'visibilityState', { value: 'hidden', configurable: true });
            Object.defineProperty(document, 'hidden', { value: true, configurable: true });
            document.dispatchEvent(new Event('visibilitychange'));
        }"""
        )

    def pretend_gamepad(self, axes: tuple[float, ...], buttons: tuple[float, ...]) -> None:
        """Simulate a gamepad with these axes and buttons, in the browser's standard order, until the next call."""
        script = """([axes, values]) => {
            const buttons = values.map((value) => ({ value, pressed: value > 0.5, touched: value > 0 }));
            const before = window.pretended;
            const known = { id: 'pretended', index: 0, mapping: 'standard', connected: true };
            window.pretended = { ...known, axes, buttons, timestamp: performance.now() };
            const event = new Event('gamepadconnected');
            event.gamepad = window.pretended;
            if (!before) window.dispatchEvent(event);
        }"""
        self.ask(script, [list(axes), list(buttons)])


def brightness(pixels: np.ndarray[Any, np.dtype[np.uint8]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the brightness (height, width) of each pixel, 0 to 255, without regard to colour."""
    made: np.ndarray[Any, np.dtype[np.float64]] = pixels.astype(np.float64) @ np.asarray(_BRIGHTNESS)
    return made


def border(pixels: np.ndarray[Any, np.dtype[np.uint8]], width: int = 8) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the pixels (n, 3) of a strip along the page's upper edge, without the corners."""
    return pixels[:width, 4 * width : -4 * width].reshape(-1, 3)


@contextmanager
def browser(out: Path) -> Iterator[Browser]:
    """Yield Chromium, which writes pictures to the folder `out`; skip the test if there is no browser."""
    program = provided_browser()
    provide_playwright()
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  # not part of our environment

    out.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=list(_ARGUMENTS))
        try:
            yield Browser(chromium, out)
        finally:
            chromium.close()
