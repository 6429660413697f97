"""Page of the console that sends messages, without a browser."""

from collections.abc import Callable
from typing import Any

from common.protocol.messages import Telemetry
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage

PERIOD_S = 0.02


class TalkingPage:
    """Page of the console, with its number and the word that identifies it."""

    def __init__(self, pages: DrivingPage, page: int = 1) -> None:
        self.pages = pages
        self.page = page
        self.word = f"page{page}"
        self.number = 0

    def content(self, **hands: Any) -> dict[str, Any]:
        self.number += 1
        return {"hands": {"page": self.word, "number": self.number, "driving": True} | hands}

    def say(self, now_s: float, **hands: Any) -> None:
        self.pages.receive(self.page, self.content(**hands), now_s)

    def go_on(self, now_s: float, for_s: float, **hands: Any) -> float:
        """Send the same inputs 50 times a second for `for_s`; return the time when the next message is due."""
        for step in range(round(for_s / PERIOD_S)):
            self.say(now_s + step * PERIOD_S, **hands)
        return now_s + round(for_s / PERIOD_S) * PERIOD_S


Does = Callable[[float], dict[str, Any] | None]
"""Function that returns the inputs at the page at a time; None if the page sends nothing"""


class AtThePage:
    """Controller of a whole run, with a page at which `does` gives the inputs."""

    def __init__(self, page: TalkingPage, simulated_hands: BrowserHands, does: Does) -> None:
        self.page = page
        self.simulated_hands = simulated_hands
        self.does = does
        self._next_s = 0.0

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        if now_s >= self._next_s:
            self._next_s += PERIOD_S
            if (hands := self.does(now_s)) is not None:
                self.page.say(now_s, **hands)
        self.simulated_hands.tick(now_s, screen, delay_s)
