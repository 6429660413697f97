"""The page of `feelahead demo --compare` in a browser, with two short invented runs."""

from pathlib import Path
from typing import Any

import pytest

from feelahead.commands.demo.compare import page_of
from feelahead.commands.demo.settings import DemoSettings
from tests.console.browser import Browser

pytestmark = [pytest.mark.console, pytest.mark.processes]


def _run(name: str, gap_mm: list[float | None], hits: list[int]) -> dict[str, Any]:
    some = [0.5] * len(hits)
    columns = {"phase": ["advancing"] * len(hits), "pull": some, "resist": some, "speed_mm_s": some}
    fastest = [80.0 if count else None for count in hits]
    at = {"figures": {"hit_first": "wall"}, "period_s": 0.05, "took_s": 0.05 * (len(hits) - 1)}
    shown = {"name": name, "gap_mm": gap_mm, "hits": hits, "fastest_mm_s": fastest, "pictures": [], "trouble": "no EGL"}
    return {**columns, **at, **shown}


def test_the_page_shows_a_contact_from_its_moment_on_and_plays_to_the_end(browser: Browser, tmp_path: Path) -> None:
    runs = [
        _run("without haptics", [30.0, 9.6, 0.0], [0, 0, 1]),
        _run("with haptics", [30.0, 20.0, None, 12.0], [0] * 4),
    ]
    path = tmp_path / "compare.html"
    path.write_text(page_of(DemoSettings(link="delay 200ms"), runs), encoding="utf-8")
    with browser.page(path.as_uri()) as page:
        page.wait_for_text("#play", "Play")
        assert page.text("#time") == "0.2 of 0.2 s"
        page.ask("show(0.05)")
        assert page.text("section .verdict") == "no contact"
        assert page.text("section [data-of=gap]") == "10 mm"
        page.ask("show(0.15)")
        assert page.text("section .verdict") == "CONTACT with wall, 80 mm/s"
        assert page.text("section:nth-child(2) .verdict") == "no contact"
        assert page.text("section:nth-child(2) [data-of=gap]") == "12 mm"
        assert page.text("#what") == "--scene wall --seed 0, --link 'delay 200ms'"
        page.ask("play(true)")
        page.wait_for_text("#play", "Play")
