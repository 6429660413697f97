"""The page fits into the smallest promised window and a large one, and can be used by keyboard alone."""

from typing import Final

import pytest

from tests.console.browser import LARGE, SMALL, Browser, Page
from tests.console.fed_page import fed_page
from tests.console.run import DRAWN, Run

pytestmark = [pytest.mark.console, pytest.mark.processes]


_FOCUSABLE: Final = """() => {
    const all = document.querySelectorAll('a[href], button, input, select, textarea, summary, [tabindex]');
    const shows = (one) => one.checkVisibility({ visibilityProperty: true });
    return [...all].filter((one) => one.tabIndex >= 0 && !one.disabled && shows(one)).map((one, number) => {
        one.dataset.reach = number;
        return one.id || one.getAttribute('aria-label') || one.textContent.trim() || one.tagName;
    });
}"""
_FOCUSED: Final = """() => {
    const one = document.activeElement;
    const style = getComputedStyle(one);
    return [one.dataset?.reach ?? null, style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2];
}"""
_CUT: Final = """() => {
    const shown = document.querySelectorAll('#state, .age, h2, dt, .meets, .trigger p, button, label');
    const cut = (one) => one.clientWidth > 0 && one.scrollWidth > one.clientWidth + 1;
    return [...shown].filter((one) => one.checkVisibility() && cut(one)).map((one) => one.textContent.trim());
}"""


_TINY: Final = """() => [...document.querySelectorAll('body *')].filter((one) => one.checkVisibility()
    && [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim())
    && parseFloat(getComputedStyle(one).fontSize) < 12).map((one) => one.outerHTML)"""


@pytest.mark.parametrize("size", [SMALL, LARGE])
def test_nothing_overflows(browser: Browser, demo: Run, size: tuple[int, int]) -> None:
    """At 1280x720 and 1920x1080 the page has no scroll bars, no word is cut, and both views are large."""
    with browser.page(demo.address, size, scene=True) as page:
        page.wait(DRAWN, "drawn both views")
        width, height = page.ask("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
        assert (width, height) == size
        assert not page.ask(_CUT)
        widths = [_inside(page, selector, size)[0] for selector in ("#overview", "#first_person")]
        for selector in ("#l2", "#r2", "#charts", "#scene", "#state"):
            _inside(page, selector, size)
        assert min(widths) >= 0.3 * size[0]
        page.raw.click("#drive")
        demo.wait_until("the page's hands", lambda run: run.facts[-1]["hands"] == "browser")
        for selector in ("#hands", "#tuning"):
            _inside(page, selector, size)
        page.picture(f"page-{size[0]}x{size[1]}")


@pytest.mark.parametrize("size", [(640, 800), (900, 600), (640, 360), SMALL])
def test_small_windows_cut_nothing_and_keep_stop_and_triggers_in_view(browser: Browser, size: tuple[int, int]) -> None:
    """Also 200 % zoom, 640x360: scrolling and notes move neither stop nor triggers out of it, and all can be read."""
    with fed_page(browser, size) as (fed, page):
        # The longest words of both triggers: the key that pulls R2 yields (`HandsFacts`).
        fed.triggers = {"travel": 1.0, "needed_m": -0.999, "course_stiffness": 1.0}
        page.wait_for_text("#r2 .yields", "pulled 100 %")
        fed.notes = [f"note {number}: something has happened that takes a line or two" for number in range(40)]
        page.wait("document.querySelectorAll('#notes li').length >= 40", "notes")
        for place in ("#overview", "#notes", "#charts", "#terms"):
            page.raw.locator(place).scroll_into_view_if_needed()
            for selector in ("#stop", "#r2", "#l2"):
                _inside(page, selector, size)
        assert page.ask("document.documentElement.scrollWidth") == size[0]
        assert not page.ask(_CUT)
        assert not page.ask(_TINY)
        page.picture(f"page-{size[0]}x{size[1]}")


def test_keyboard_reaches_everything(browser: Browser, demo: Run) -> None:
    """The Tab key reaches every control, shows where the focus is, and is never trapped."""
    with browser.page(demo.address) as page:
        page.wait(DRAWN, "drawn both views")
        names = page.ask(_FOCUSABLE)
        assert len(names) > 0, "nothing can be reached"
        reached, unmarked = set(), set()
        for _ in range(3 * len(names) + 20):
            page.press("Tab")
            number, marked = page.ask(_FOCUSED)
            if number is not None:
                reached.add(int(number))
                if not marked:
                    unmarked.add(names[int(number)])
            if len(reached) == len(names):
                break
        missed = [name for number, name in enumerate(names) if number not in reached]
        assert not missed
        assert not unmarked


def _inside(page: Page, selector: str, size: tuple[int, int]) -> tuple[float, float]:
    box = page.raw.locator(selector).bounding_box() or dict.fromkeys(("x", "y", "width", "height"), 0.0)
    x, y, width, height = box["x"], box["y"], box["width"], box["height"]
    assert width > 0
    assert height > 0
    assert x >= 0
    assert y >= 0
    assert x + width <= size[0]
    assert y + height <= size[1]
    return width, height
