"""Height and target are drawn into both camera views, and said in words and keys."""

import pytest

from tests.console.browser import Browser
from tests.console.fed_page import fed_page

pytestmark = [pytest.mark.console, pytest.mark.processes]

_LINE = """(view) => {
    const box = document.querySelector(`#${view} canvas`).getBoundingClientRect();
    const [line, label] = ["line:not(.under)", ".height"].map((part) => document.querySelector(`#${view} ${part}`));
    const place = (x, y) => [(line[x].baseVal.value - box.width / 2) / (box.height / 2),
                             (box.height / 2 - line[y].baseVal.value) / (box.height / 2)];
    const { left, right, top, bottom } = label.getBoundingClientRect();
    const inside = left >= box.left && right <= box.right && top >= box.top && bottom <= box.bottom;
    return [place("x1", "y1"), place("x2", "y2"), label.textContent, inside && label.checkVisibility()];
}"""


@pytest.mark.parametrize("size", [(1280, 720), (640, 800)])
def test_a_line_down_shows_the_height_in_both_views(browser: Browser, size: tuple[int, int]) -> None:
    with fed_page(browser, size) as (_, page):
        page.wait_for_text(".near", "200 mm above table")
        page.wait_for_text(".near", "150 right")  # the tool lies on its side
        for view in ("overview", "first_person"):
            point, below, height, shown = page.ask(_LINE, view)
            assert (height, shown) == ("200 mm", True)
            assert page.ask("(view) => document.querySelector(`#${view} .outline b`).textContent", view) == "mug"
            # The overview looks straight down; the other view is level, 0.3 m behind the gripper and 0.1 m above.
            scale = {"overview": 3**0.5, "first_person": 1 / 0.7002}[view]
            if view == "overview":
                assert point[0] == pytest.approx(0.0, abs=0.01)
                assert point[1] * 1.0 == pytest.approx(below[1] * 1.2, abs=0.02)
            else:
                assert point == pytest.approx([0.0, -scale * 0.1 / 0.3], abs=0.01)
                assert below == pytest.approx([0.0, -scale * 0.3 / 0.3], abs=0.01)
        page.picture(f"cues-{size[0]}x{size[1]}")
