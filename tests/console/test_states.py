"""In every state, made up, and every size: nothing moves, and nothing that is written covers the target."""

from typing import Any, Final

import pytest

from tests.console.browser import Browser
from tests.console.pictures.page import SIZES
from tests.console.states import STATES, states

pytestmark = [pytest.mark.console, pytest.mark.processes]

_SETTLED: Final = """() => new Promise((done) => {
    scrollTo(0, 0);
    requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)));
})"""
_FIXED: Final = "button, .view, .picture, .near, .near > div, .trigger, #figures dd, #tuning input, #charts"
_PLACES: Final = """(fixed) => {
    const visible = (one) => one.checkVisibility({ visibilityProperty: true });
    const shown = [...document.querySelectorAll(fixed)].filter(visible);
    return Object.fromEntries(shown.map((one) => {
        const { x, y, width, height } = one.getBoundingClientRect();
        const name = one.id || `${one.className} ${one.closest('[id]').id}`;
        return [name, [x, y, width, height].map(Math.round)];
    }));
}"""
_COVERS: Final = """() => [...document.querySelectorAll('.view')].flatMap((view) => {
    const box = (one) => one.getBoundingClientRect();
    const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
    const shown = (one) => one.checkVisibility({ visibilityProperty: true });
    const target = [...view.querySelectorAll('.outline, .outline b')].filter(shown);
    const written = [...document.querySelectorAll('h2, output, p, b, dl, button, #hands_off')];
    const others = written.filter((one) => shown(one) && one.textContent && !one.closest('.outline, #lost'));
    return others.filter((one) => target.some((other) => meet(box(one), box(other)))).map((one) => one.outerHTML);
})"""


def test_nothing_moves_and_nothing_covers_the_target(browser: Browser) -> None:
    """Views, buttons and figures stand in the same places whatever is said and shown."""
    first: dict[tuple[tuple[int, int], str], tuple[str, Any]] = {}
    seen = []
    for state, page in states(browser):
        seen.append(state)
        for size in SIZES:
            page.raw.set_viewport_size({"width": size[0], "height": size[1]})
            page.ask(_SETTLED)
            assert page.ask(_COVERS) == [], f"{state} at {size}"
            moved = {}
            for name, place in page.ask(_PLACES, _FIXED).items():
                before = first.setdefault((size, name), (state, place))
                if before[1] != place:
                    moved[name] = (before, place)
            assert moved == {}, f"{state} at {size}"
    assert tuple(seen) == STATES
