"""What is drawn, and whether it is true."""

import re
import time
from typing import Any, Final

from tests.console.browser import Page
from tests.console.stage import DRAWN, Stage
from tests.containers.watch import CheckFailedError, check

VIEWS: Final = ("overview", "first_person")
_OLDEST_MS: Final = 500.0
_PATIENCE_S: Final = 60.0
_LEAST_DETAIL: Final = 8.0
"""Standard deviation of a picture's colours: an empty one has none."""


def both_views_move(stage: Stage) -> str:
    """Both cameras' pictures are drawn, have something on them, change, and say their age."""
    with stage.browser.page(stage.run.address) as page:
        page.wait(DRAWN, "drawn both views")
        said = []
        for view in VIEWS:
            before = page.pixels(f"#{view} canvas")
            check(before.std() > _LEAST_DETAIL, f"{view} is empty: its colours differ by {before.std():.1f}")
            changed = _changed(page, view, before)
            rate = page.updates_per_second(f"#{view}")
            said.append(f"{view} {rate:.0f} updates/s, {100 * changed:.1f} % of it moved")
        # How old on a busy machine is for a benchmark to say; at some moment both have to be fresh.
        end_s = time.monotonic() + _PATIENCE_S
        while (oldest := _oldest_ms(page)) >= _OLDEST_MS:
            check(time.monotonic() < end_s, f"a picture was {oldest:.0f} ms old; asked: below {_OLDEST_MS:.0f}")
        page.picture("views")
    return f"{'; '.join(said)}; at most {oldest:.0f} ms old"


def scene_is_drawn(stage: Stage) -> str:
    """The scene has something on it, beside what the page says of it in words."""
    with stage.browser.page(stage.run.address, scene=True) as page:
        page.wait("!document.querySelector('#scene iframe').hidden", "a scene", _PATIENCE_S)
        end_s = time.monotonic() + _PATIENCE_S
        while (spread := page.pixels("#scene iframe").std()) <= _LEAST_DETAIL:
            check(time.monotonic() < end_s, f"the scene is empty: its colours differ by {spread:.1f}")
        page.picture("scene")
    return f"its colours differ by {spread:.0f}"


def triggers_agree(stage: Stage) -> str:
    """What stands beside the triggers, and how high their zones are drawn, is what the operator side wrote."""
    with stage.browser.page(stage.run.address) as page:
        page.wait("document.querySelectorAll('#r2 .zones b').length == 10", "drawn the zones")
        stage.run.wait_until("armed", lambda run: run.status.get("state") == "armed", 60.0)
        script = """() => ['l2', 'r2'].map((side) => [...document.querySelectorAll(`#${side} .zones div`)]
            .map((zone) => {
            const bar = zone.querySelector('i').getBoundingClientRect();
            return [Number(zone.querySelector('b').textContent), bar.height / zone.getBoundingClientRect().height];
        }))"""
        compared, stiff, end_s = 0, 0, time.monotonic() + 20.0
        while time.monotonic() < end_s and (compared < 30 or stiff < 5):
            seen: list[list[tuple[float, float]]] = page.ask(script)
            time.sleep(0.15)
            stage.run.look()
            newest = [[list(facts[side]["zones"]) for side in ("l2", "r2")] for facts in list(stage.run.facts)[-8:]]
            shown = [[round(number) for number, _ in side] for side in seen]
            for side in seen:
                for number, height in side:
                    check(abs(height - number / 8) < 0.04, f"strength {number:.0f} is drawn {height:.2f} high")
            compared += 1
            # Zones that rise and fall within a tenth of a second are in no two places the same.
            if shown in newest:
                stiff += any(map(any, shown))
            elif all(before == newest[0] for before in newest):
                raise CheckFailedError(f"zones {shown} are shown, and {newest[-1]} were written")
        check(stiff > 0, "no trigger stiffened while it was looked at")
        page.picture("triggers")
    return f"{compared} looks, {stiff} of them at stiff zones that agreed"


def words_agree(stage: Stage) -> str:
    """State, link and target in words are those of the run."""
    with stage.browser.page(stage.run.address) as page:
        page.wait("document.querySelector('#link').textContent == 'up'", "link up")
        seen: set[str] = set()
        for _ in range(20):
            before = page.text("#state")
            stage.run.look()
            status: dict[str, Any] = stage.run.status
            seen.add(before)
            time.sleep(0.1)
            stage.run.look()
            if status.get("state") == stage.run.status.get("state") == "armed" and page.text("#state") == before:
                check("ARMED" in before or "RELEASE" in before, f"armed is said as {before!r}")
        check(page.text("#target") == stage.run.status.get("target"), f"the target is said as {page.text('#target')!r}")
    return f"said: {', '.join(sorted(seen))}"


def _changed(page: Page, view: str, before: Any) -> float:
    """Which share of the view changes within some seconds; the arm moves most of the time."""
    end_s = time.monotonic() + 15.0
    while time.monotonic() < end_s:
        after = page.pixels(f"#{view} canvas")
        share = float((abs(after.astype(int) - before.astype(int)).max(axis=2) > 24).mean())
        if share > 0.002:
            return share
        time.sleep(0.3)
    raise CheckFailedError(f"{view} stands still")


def _oldest_ms(page: Page) -> float:
    """The greatest age that either view says within two seconds."""
    ages = []
    for _ in range(20):
        for view in VIEWS:
            found = re.search(r"(\d+) ms", page.text(f"#{view} .age"))
            check(found is not None, f"{view} says no age: {page.text(f'#{view} .age')!r}")
            ages.append(float(found[1]) if found else 0.0)
        time.sleep(0.1)
    return sorted(ages)[-3]
