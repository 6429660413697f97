"""Every state of the page, with made-up content, so that all can be had at once."""

from collections.abc import Iterator
from typing import Final

from msgspec.structs import replace

from common.protocol.view_messages import Near
from common.status.codes import Doing, LinkState
from operator_side.viewing.facts import PictureState
from tests.console.browser import Browser, Page
from tests.console.fed_page import AGE, FRESH, Fed, fed_page
from tests.console.run import STATE
from tests.operator_side.console_feed import ADVANCES_ALONG_X

_WHILE_DRIVEN: Final = ("running", "grasp", "close", "amber", "dead")
STATES: Final = ("waiting", "ready", "armed", *_WHILE_DRIVEN, "stopped", "reset", "replay", "link-lost", "ended")
_MUCH: Final = {
    "rate_kbit_s": 12345.0,
    "queue_ms": 1234.0,
    "lost_percent": 12.3,
    "pictures": "15 Hz, quality 75, size 0.5",
    "held_back": "pictures 12 (rate), scene 3 (queue)",
    "hindrance": "joint 3 is at its limit, joint 5 at its fastest",
    "speed_scale": 0.25,
    "stands": True,
}
"""Much to say in the bar and below the views"""
_GRASP: Final = {"tool_pose": (0.6, 0.0, 0.06, *ADVANCES_ALONG_X), "near": Near("mug", 0.0, 0.0, "mug")}
_CLOSE: Final = {"tool_pose": (0.8, 0.0, 0.06, *ADVANCES_ALONG_X), "near": Near("mug", 0.03, 0.03)}
"""The target between the fingers, and so near to the eye that it fills the picture"""


def states(one: Browser) -> Iterator[tuple[str, Page]]:
    """Yield the name of each state, and a page that shows it."""
    with fed_page(one) as (fed, page):
        fed.tells = fed.sends = False
        with one.page(str(fed.address)) as opened:
            yield "waiting", opened
        fed.tells = fed.sends = True
        fed.page = replace(fed.page, driver=None)
        fed.state, fed.status = "disarmed", {"person": Doing.READY}
        page.raw.click("#drive")
        page.wait_for_text("#hands_state", "Ready")
        yield "ready", page
        fed.state, fed.status = "armed", {}
        page.raw.click("#drive")
        yield "armed", page
        fed.status = {"person": Doing.READY}
        page.raw.click("#drive")
        page.wait_for_text("#hands_state", "Ready")
        with page.held("Space"):
            yield from _driven(fed, page)
        driven, fed.page = fed.page, replace(fed.page, reset_first=True)
        fed.state, fed.status = "stopped", {"person": Doing.ALL_KEYS_UP_FIRST}
        page.wait(f"{STATE} == 'stopped'", "shown as stopped")
        yield "stopped", page
        fed.page, fed.status = driven, {**fed.status, "stop_reset": True}
        page.wait(f"{STATE} == 'disarmed'", "shown as reset")
        yield "reset", page
        page.raw.click("#replay")
        page.wait(f"{AGE} == 'replay'", "shown as a replay")
        yield "replay", page
        page.raw.click("#replay")
        fed.state, fed.status = "armed", {"link": LinkState.LOST, "person": Doing.ALL_KEYS_UP_FIRST}
        page.wait(f"{STATE} == 'lost'", "shown as lost")
        yield "link-lost", page
        fed.ends.set()
        page.wait_for_text("#lost", "run has ended")
        yield "ended", page
        page.complaints.clear()  # the console is gone


def _driven(fed: Fed, page: Page) -> Iterator[tuple[str, Page]]:
    driven = fed.page
    fed.status = {"person": Doing.RUNNING} | _MUCH
    page.wait_for_text("#hands_state", "You drive")
    yield "running", page
    fed.scene = _GRASP
    page.wait_for_text(".near", "mug, it stands")
    yield "grasp", page
    fed.scene = _CLOSE
    page.wait_for_text(".near", "mug 30 mm")
    yield "close", page
    fed.scene, fed.status = {}, {"person": Doing.RUNNING}
    fed.page = replace(driven, counts=0.0, because="pictures are 1000 ms old")
    fed.age_s, fed.pictures = 1.0, replace(FRESH, states=(PictureState.OLD,) * 2)
    page.wait(f"{AGE} == 'old'", "amber")
    yield "amber", page
    fed.sends, fed.pictures = False, replace(FRESH, states=(PictureState.DEAD,) * 2)
    page.wait(f"{AGE} == 'dead'", "dead")
    yield "dead", page
    fed.page, fed.age_s, fed.sends, fed.pictures = driven, 0.0, True, FRESH
