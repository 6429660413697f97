"""The page draws both views, the scene and the triggers as the run has them."""

import math
import re
import time
from typing import Any, Final

import pytest

from tests.console.browser import LARGE, SMALL, Browser, Page
from tests.console.fed_page import fed_page
from tests.console.run import DRAWN, Run

pytestmark = [pytest.mark.console, pytest.mark.processes]


VIEWS: Final = ("overview", "first_person")
_PATIENCE_S: Final = 60.0
_LEAST_DETAIL: Final = 8.0
"""Minimum standard deviation of a picture's colours: it is 0 in an empty picture"""
_LINE = """(view) => {
    const box = document.querySelector(`#${view} canvas`).getBoundingClientRect();
    const [line, label] = ["line:not(.under)", ".height"].map((part) => document.querySelector(`#${view} ${part}`));
    const place = (x, y) => [(line[x].baseVal.value - box.width / 2) / (box.height / 2),
                             (box.height / 2 - line[y].baseVal.value) / (box.height / 2)];
    const { left, right, top, bottom } = label.getBoundingClientRect();
    const inside = left >= box.left && right <= box.right && top >= box.top && bottom <= box.bottom;
    return [place("x1", "y1"), place("x2", "y2"), label.textContent, inside && label.checkVisibility()];
}"""


@pytest.mark.quiet
def test_both_views_move(browser: Browser, fresh_demo: Run) -> None:
    """The pictures of both cameras are drawn, not empty, and change; the page shows their age."""
    with browser.page(fresh_demo.address) as page:
        page.wait(DRAWN, "drawn both views")
        for view in VIEWS:
            before = page.pixels(f"#{view} canvas")
            assert before.std() > _LEAST_DETAIL
            _wait_for_change(page, view, before)
        # A busy machine may delay pictures, so it is enough if both are fresh at some time.
        end_s = time.monotonic() + _PATIENCE_S
        while _oldest_ms(page) >= 500.0:
            assert time.monotonic() < end_s
        page.picture("views")


@pytest.mark.quiet
def test_scene_is_drawn(browser: Browser, fresh_demo: Run) -> None:
    """The drawing of the scene is not empty."""
    with browser.page(fresh_demo.address, scene=True) as page:
        page.wait("!document.querySelector('#scene iframe').hidden", "a scene", _PATIENCE_S)
        end_s = time.monotonic() + _PATIENCE_S
        while page.pixels("#scene iframe").std() <= _LEAST_DETAIL:
            assert time.monotonic() < end_s
        page.picture("scene")


@pytest.mark.quiet
def test_triggers_agree(browser: Browser, fresh_demo: Run) -> None:
    """Numbers and bars of the ten zones show the strengths that the operator side wrote to the controller."""
    with browser.page(fresh_demo.address) as page:
        page.wait("document.querySelectorAll('#r2 .zones b').length == 10", "drawn the zones")
        fresh_demo.wait_until("armed", lambda run: run.status.get("state") == "armed")
        script = """() => ['l2', 'r2'].map((side) => [...document.querySelectorAll(`#${side} .zones div`)]
            .map((zone) => {
            const bar = zone.querySelector('i').getBoundingClientRect();
            return [Number(zone.querySelector('b').textContent), bar.height / zone.getBoundingClientRect().height];
        }))"""
        compared, stiff, end_s = 0, 0, time.monotonic() + 20.0
        while time.monotonic() < end_s and (compared < 30 or stiff < 5):
            seen: list[list[tuple[float, float]]] = page.ask(script)
            time.sleep(0.15)
            fresh_demo.look()
            newest = [[list(facts[side]["zones"]) for side in ("l2", "r2")] for facts in list(fresh_demo.facts)[-8:]]
            shown = [[round(number) for number, _ in side] for side in seen]
            for side in seen:
                for number, height in side:
                    assert abs(height - number / 8) < 0.04
            compared += 1
            # Zones that rise and fall within a tenth of a second are in no two places the same.
            if shown in newest:
                stiff += any(map(any, shown))
            elif all(before == newest[0] for before in newest):
                raise AssertionError(f"zones {shown} are shown, and {newest[-1]} were written")
        assert stiff > 0, "no trigger stiffened while it was looked at"
        page.picture("triggers")


@pytest.mark.parametrize("size", [(1280, 720), (640, 800)])
def test_the_height_is_a_line_down_in_both_views_and_the_yielding_pull_is_said(
    browser: Browser, size: tuple[int, int]
) -> None:
    """The overview looks straight down from 1.2 m; the other eye is level, 0.3 m behind the gripper and 0.1 m above."""
    with fed_page(browser, size) as (_, page):
        page.wait_for_text(".near", "200 mm over table")
        page.wait_for_text(".near", "150 right")  # the tool lies on its side
        page.wait_for_text("#r2 .yields", "yields: a 2 N finger")
        assert not page.ask("document.querySelector('#l2 .yields')")
        half = math.tan(math.radians(35.0))
        for view in VIEWS:
            point, below, height, shown = page.ask(_LINE, view)
            assert (height, shown) == ("200 mm", True)
            assert page.text(f"#{view} .outline b") == "mug"
            if view == "overview":
                assert [point[0], point[1]] == pytest.approx([0.0, below[1] * 1.2], abs=0.02)
            else:
                assert [*point, *below] == pytest.approx([0.0, -0.1 / 0.3 / half, 0.0, -0.3 / 0.3 / half], abs=0.01)


@pytest.mark.parametrize("size", [(640, 800), SMALL, LARGE])
def test_the_space_that_no_depth_camera_has_seen_is_shown_by_its_side(browser: Browser, size: tuple[int, int]) -> None:
    with fed_page(browser, size) as (fed, page):
        page.wait("document.querySelector('.near dd')", "shown what is near")
        assert not page.raw.locator("#near_unseen").is_visible()
        fed.scene = {"unseen": (0.04, 0.8, 0.0, 0.555, 1.0)}
        page.wait_for_text("#near_unseen .down", "100")
        shares = [page.text(f"#near_unseen .{side}") for side in ("ahead", "left", "right", "up")]
        assert shares == ["4", "80", "0", "56"]
        title = page.raw.locator("#near_unseen").get_attribute("title") or ""
        assert "left 80 %, ahead 4 %, right 0 %" in title
        places = [page.raw.locator(f"#near_unseen .{side}").bounding_box() for side in ("left", "ahead", "right")]
        assert [place["x"] for place in places] == sorted(place["x"] for place in places)
        page.picture(f"unseen-{size[0]}x{size[1]}")
        fed.scene = {}
        page.wait("document.querySelector('#near_unseen').hidden", "hidden it")


def _wait_for_change(page: Page, view: str, before: Any) -> None:
    """Wait until a part of the view has changed; the arm moves most of the time."""
    end_s = time.monotonic() + 15.0
    while time.monotonic() < end_s:
        after = page.pixels(f"#{view} canvas")
        share = float((abs(after.astype(int) - before.astype(int)).max(axis=2) > 24).mean())
        if share > 0.002:
            return
        time.sleep(0.3)
    raise AssertionError(f"{view} stands still")


def _oldest_ms(page: Page) -> float:
    """Return the third-greatest of 40 ages that the two views show within two seconds: two may be exceptions."""
    ages = []
    for _ in range(20):
        for view in VIEWS:
            found = re.search(r"(\d+) ms", page.text(f"#{view} .age"))
            assert found is not None
            ages.append(float(found[1]) if found else 0.0)
        time.sleep(0.1)
    return sorted(ages)[-3]
