"""Console that a thread feeds with facts and pictures in a test's hands: no robot side takes part."""

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Final

from msgspec.structs import replace

from common.clock import MonotonicClock
from common.protocol.codec import decode_view, encode
from common.protocol.messages import MotionState
from common.protocol.view_messages import VIEW_NAMES, SceneState
from common.status.codes import InputSource
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import HandsFacts, PictureFacts, PictureState
from tests.console.browser import SMALL, Browser, Page
from tests.helpers.machines.waiting import wait_until
from tests.operator_side.console_feed import Pictures, facts, shapes, state

FRESH: Final = PictureFacts((0.4,) * 2, (0.5,) * 2, (PictureState.FRESH,) * 2)
AGE: Final = "document.querySelector('#overview').dataset.age"


@dataclass
class Fed:
    """Facts and pictures of a console, fed in a thread; a test changes them."""

    age_s: float = 0.0
    sends: bool = True
    """Whether pictures come"""
    tells: bool = True
    """Whether facts come"""
    state: MotionState = "armed"
    status: dict[str, Any] = field(default_factory=dict)
    """Changes to the status"""
    scene: dict[str, Any] = field(default_factory=dict)
    """Changes to the scene's state"""
    triggers: dict[str, Any] = field(default_factory=dict)
    """Changes to the facts of both triggers"""
    whose: InputSource = InputSource.BROWSER
    """Whose inputs move the arm"""
    page: HandsFacts = field(default_factory=lambda: HandsFacts(True, "page", False, "", None, yields=(False, True)))
    """Facts for the page; a page that asks to drive is the driver"""
    pictures: PictureFacts = FRESH
    hands: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=1000))
    """Inputs that pages have sent, newest last"""
    stops: bool = False
    """Whether the page's emergency stop has come"""
    notes: list[str] = field(default_factory=list)
    address: str | None = None
    ends: threading.Event = field(default_factory=threading.Event)

    def feed(self) -> None:
        clock, pictures, step, driver = MonotonicClock(), Pictures(), 0, ""
        with Console("test") as console:
            while not self.ends.wait(0.05):
                console.receive(clock.now())
                self.address, now_s, step = console.address, clock.now(), step + 1
                for _, said in console.words:
                    if said is not None and "hands" in said:
                        self.hands.append(said["hands"])
                        driver = said["hands"]["page"] if said["hands"]["driving"] else ""
                        self.stops |= said["hands"]["stop"]
                console.words.clear()
                made = facts(now_s, self.state)
                page = replace(self.page, driver=driver or self.page.driver)
                status = replace(made.status, **self.status)
                while self.notes:
                    console.note(self.notes.pop())
                if step % 20 == 0:
                    console.view(shapes(), video=False)
                sways = decode_view(state(now_s))
                assert isinstance(sways, SceneState)
                console.view(encode(replace(sways, **self.scene)), video=False)
                if self.tells:
                    told = {"hands": self.whose, "page": page, "status": status, "pictures": self.pictures}
                    l2, r2 = (replace(trigger, **self.triggers) for trigger in (made.l2, made.r2))
                    console.facts(replace(made, l2=l2, r2=r2, **told))
                for view in VIEW_NAMES if self.sends else ():
                    console.view(pictures.frame(view, now_s, step, now_s - self.age_s), video=True)


@contextmanager
def fed_page(browser: Browser, size: tuple[int, int] = SMALL) -> Iterator[tuple[Fed, Page]]:
    """Yield the page open at `size`, with fresh pictures, and what feeds it."""
    fed = Fed()
    thread = threading.Thread(target=fed.feed)
    thread.start()
    try:
        wait_until("a console's address", lambda: fed.address)
        with browser.page(str(fed.address), size) as page:
            page.wait(f"{AGE} == 'fresh'", "fresh pictures")
            yield fed, page
    finally:
        fed.ends.set()
        thread.join()
