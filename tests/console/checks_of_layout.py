"""Everything has its place, at the smallest size that is promised and at a large one, and by keyboard alone."""

from typing import Final

from tests.console.browser import LARGE, SMALL, Page
from tests.console.stage import DRAWN, Stage
from tests.containers.watch import check

_FOCUSABLE: Final = """() => {
    const all = document.querySelectorAll('a[href], button, input, select, textarea, summary, [tabindex]');
    return [...all].filter((one) => one.tabIndex >= 0 && !one.disabled && one.checkVisibility()).map((one, number) => {
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


def nothing_overflows(stage: Stage) -> str:
    """1280x720 and 1920x1080: no scroll bars of the page, no words cut, both views large."""
    said = []
    for size in (SMALL, LARGE):
        with stage.browser.page(stage.run.address, size, scene=True) as page:
            page.wait(DRAWN, "drawn both views")
            width, height = page.ask("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
            check((width, height) == size, f"{size}: the page takes {width}x{height}")
            check(not (cut := page.ask(_CUT)), f"{size}: cut: {cut}")
            widths = [_inside(page, selector, size)[0] for selector in ("#overview", "#first_person")]
            for selector in ("#l2", "#r2", "#charts", "#scene", "#state"):
                _inside(page, selector, size)
            check(min(widths) >= 0.3 * size[0], f"{size}: views {widths} wide")
            page.raw.click("#drive")
            stage.run.wait_until("the page's hands", lambda run: run.facts[-1]["hands"] == "browser", 10.0)
            for selector in ("#hands", "#tuning"):
                _inside(page, selector, size)
            page.picture(f"page-{size[0]}x{size[1]}")
            said.append(f"{size[0]}x{size[1]}: views {min(widths):.0f} wide")
    return ", ".join(said)


def keyboard_reaches_everything(stage: Stage) -> str:
    """Tab goes to everything that can be used, each with a mark to see, and not into a trap."""
    with stage.browser.page(stage.run.address) as page:
        page.wait(DRAWN, "drawn both views")
        names = page.ask(_FOCUSABLE)
        check(len(names) > 0, "nothing can be reached")
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
        check(not missed, f"not reached: {', '.join(missed)}")
        check(not unmarked, f"without a mark: {', '.join(sorted(unmarked))}")
    return f"{len(names)} places"


def _inside(page: Page, selector: str, size: tuple[int, int]) -> tuple[float, float]:
    """Its width and height; CheckFailedError unless it lies within the page."""
    box = page.raw.locator(selector).bounding_box() or dict.fromkeys(("x", "y", "width", "height"), 0.0)
    x, y, width, height = box["x"], box["y"], box["width"], box["height"]
    check(width > 0 and height > 0, f"{size}: {selector} is not there")
    check(
        x >= 0 and y >= 0 and x + width <= size[0] and y + height <= size[1], f"{size}: {selector} reaches out: {box}"
    )
    return width, height
