"""Choice of the page that drives, and whether its hands count: keys lost by a browser must never move the arm.

nobody ─▶ resting ─▶ ready ─▶ running         the page that drives: the first that began on purpose
             ▲         │         │
             └─────────┴─────────┘  a key besides hold-to-run, hold-to-run released, a stop, a disarmed arm
After a stop the hands rest until it was reset on purpose: hold-to-run alone never arms again.
silence for 150 ms, a page that stops driving or closes: nobody, and the next driver rests first
"""

from collections import deque
from typing import Final

import msgspec

from common.status.codes import Doing
from operator_side.core import OperatorSide
from operator_side.viewing.facts import HandsFacts
from operator_side.viewing.pages.page_messages import PageHands, PageMessage, TuneWish
from operator_side.viewing.pages.pictures import Pictures

SILENCE_S: Final = 0.15
"""Silence after which a page drives no more, and its stop counts as released, in seconds."""
REST_S: Final = 1.0
"""Time with all keys up before hold-to-run counts, in seconds."""
_MOST_WISHES: Final = 16
"""Capacity between two turns."""


class DrivingPage:
    """Receiver of pages' messages; `now_s` is the time of arrival."""

    def __init__(self, *, may_drive: bool = True) -> None:
        """may_drive: False while a real controller drives: pages can still stop, and tune."""
        self.may_drive = may_drive
        self.rejected = 0
        """Number of invalid messages."""
        self.pictures = Pictures()
        """Freshness of what pages show"""
        self.stale = 0
        """Number of messages that others of the same page had overtaken; only their stop counts."""
        self.silences = 0
        """Number of times that a driving page was silent for too long"""
        self._numbers: dict[int, int] = {}
        """Number of the newest message of each open page"""
        self._refused: set[int] = set()
        self._driver: int | None = None
        self._newest: PageHands | None = None
        self._heard_s = 0.0
        self._up_since_s: float | None = None
        self.doing = Doing.NOBODY_DRIVES
        """Action of the page that drives, as of the last call"""
        self._stop_s: float | None = None
        self.reset_first = False
        """Whether a stop waits for its reset, so that no page's hands count"""
        self._giving_back: set[int] = set()
        self._give_back = False
        self.wishes: deque[TuneWish] = deque(maxlen=_MOST_WISHES)

    @property
    def driver(self) -> str | None:
        """Word of the page that drives, as of the last call; None for none."""
        return None if self._newest is None else self._newest.page

    def receive(self, page: int, content: object, now_s: float) -> None:
        """Take one message of the page of this number; an invalid one is refused whole, and counted."""
        self._expire(now_s)
        try:
            message = msgspec.convert(content, PageMessage)
        except msgspec.ValidationError:
            self.rejected += 1
            return
        if message.tune is not None:
            self.wishes.append(message.tune)
        if message.hands is not None:
            self._take(page, message.hands, now_s)

    def close(self, page: int, now_s: float) -> None:
        """Forget the page, as it is gone."""
        self._expire(now_s)
        self._numbers.pop(page, None)
        for gone in (self._refused, self._giving_back):
            gone.discard(page)
        if page == self._driver:
            self._let_go()

    def hands(self, now_s: float) -> PageHands | None:
        """Return the driving page's hands once they count; None while they rest, or nobody drives."""
        self._expire(now_s)
        return self._newest if self.doing is Doing.RUNNING else None

    def driven(self, now_s: float) -> bool:
        """Return whether a page drives, even at rest."""
        self._expire(now_s)
        return self._driver is not None

    def stopping(self, now_s: float) -> bool:
        """Return whether any page presses the emergency stop."""
        return self._stop_s is not None and now_s - self._stop_s < SILENCE_S

    def rest_anew(self) -> None:
        """Require all keys up again before hold-to-run counts."""
        if self._driver is not None:
            self.doing, self._up_since_s = Doing.ALL_KEYS_UP_FIRST, None

    def require_reset(self) -> None:
        """Let no page's hands count before a reset, as the arm was stopped."""
        self.reset_first = self.may_drive
        self.rest_anew()

    def take_give_back(self) -> bool:
        """Return whether a page has handed back to the scripted person since the last call."""
        given, self._give_back = self._give_back, False
        return given

    def follow(self, core: OperatorSide, now_s: float) -> None:
        """Apply pages' stops, as the controller's, and their tuning wishes; call it every turn."""
        self.pictures.follow(core, None if self._newest is None else self._newest.shown_s, now_s)
        if self.stopping(now_s):
            core.press_stop(now_s)
        while self.wishes:
            wish = self.wishes.popleft()
            core.tune(wish.probability, wish.link, now_s)

    def facts(self, core: OperatorSide, now_s: float, *, person: bool) -> HandsFacts:
        """Return the facts for the pages. person: as in HandsFacts."""
        self._expire(now_s)
        known = (self.may_drive, self.driver, person, core.tuner.why, core.tuner.link)
        return HandsFacts(*known, counts=self.pictures.hands, reset_first=self.reset_first)

    def _take(self, page: int, hands: PageHands, now_s: float) -> None:
        if hands.stop:  # even an overtaken one
            self._stop_s = now_s
            self.require_reset()
        if hands.number <= self._numbers.get(page, -1):
            self.stale += 1
            return
        self._numbers[page] = hands.number
        if hands.reset and self._driver in (None, page) and not self.stopping(now_s):
            self.reset_first = False
        self._choose(page, hands)
        if page == self._driver:
            self._newest, self._heard_s = hands, now_s
            self._follow(hands, now_s)

    def _choose(self, page: int, hands: PageHands) -> None:
        """Choose the driver after this message: nobody takes over from a page that drives."""
        may_give_back = self._driver in (None, page) and page not in self._giving_back and not self.reset_first
        (self._giving_back.add if hands.give_back else self._giving_back.discard)(page)
        if hands.give_back and may_give_back:
            self._give_back = True
        if not hands.driving or hands.give_back:
            self._refused.discard(page)
            if page == self._driver:
                self._let_go()
        elif self._driver is None and self.may_drive and page not in self._refused:
            self._driver = page
            self.doing, self._up_since_s = Doing.ALL_KEYS_UP_FIRST, None
        elif page != self._driver:
            # It must stop asking before it may ask again: nobody drives by accident.
            self._refused.add(page)

    def _follow(self, hands: PageHands, now_s: float) -> None:
        match self.doing:
            case Doing.ALL_KEYS_UP_FIRST:
                since_s = self._up_since_s
                if since_s is not None and now_s - since_s >= REST_S:
                    self.doing = Doing.READY
                    self._follow(hands, now_s)
                elif self.reset_first or not hands.all_up:
                    self._up_since_s = None
                elif since_s is None:
                    self._up_since_s = now_s
            case Doing.READY:
                if hands.run and not hands.stop:
                    self.doing = Doing.RUNNING
                elif not hands.all_up:
                    self.rest_anew()
            case Doing.RUNNING:
                if not hands.run or hands.stop:
                    self.rest_anew()

    def _expire(self, now_s: float) -> None:
        if self._driver is not None and now_s - self._heard_s > SILENCE_S:
            self.silences += 1
            self._let_go()

    def _let_go(self) -> None:
        self._driver = self._newest = self._up_since_s = None
        self.doing = Doing.NOBODY_DRIVES
