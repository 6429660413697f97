"""Which page drives, and whether its hands count: keys that a browser lost must never move the arm.

nobody ─▶ resting ─▶ ready ─▶ running         of the page that drives, the first that began on purpose
             ▲         │         │
             └─────────┴─────────┘  a key besides hold-to-run, hold-to-run let go, a stop, a disarmed arm
silence for 150 ms, a page that lets go or closes: nobody, and whoever drives next rests first
"""

from collections import deque
from typing import Final

import msgspec

from common.status.codes import Doing
from operator_side.core import OperatorSide
from operator_side.viewing.facts import HandsFacts
from operator_side.viewing.pages.page_messages import PageHands, PageMessage, TuneWish

SILENCE_S: Final = 0.15
"""Without a message for so long a page drives no more, and a stop of it is not pressed any more."""
REST_S: Final = 1.0
"""All keys are up for so long before hold-to-run counts."""
_MOST_WISHES: Final = 16
"""From one turn to the next."""


class DrivingPage:
    """Takes what pages say; `now_s` is the time at which that arrived."""

    def __init__(self, *, may_drive: bool = True) -> None:
        """`may_drive`: False where a real controller drives: pages can still stop, and tune."""
        self.may_drive = may_drive
        self.rejected = 0
        """Messages that were none."""
        self.stale = 0
        """Messages that others of the same page had overtaken; only a stop in them counts."""
        self.silences = 0
        """How often a page that drove was silent for too long"""
        self._numbers: dict[int, int] = {}
        """The newest message of each open page"""
        self._refused: set[int] = set()
        self._driver: int | None = None
        self._newest: PageHands | None = None
        self._heard_s = 0.0
        self._up_since_s: float | None = None
        self.doing = Doing.NOBODY_DRIVES
        """Of the page that drives, by what was last heard or asked"""
        self._stop_s: float | None = None
        self._giving_back: set[int] = set()
        self._give_back = False
        self.wishes: deque[TuneWish] = deque(maxlen=_MOST_WISHES)

    @property
    def driver(self) -> str | None:
        """The word of the page that drives, by what was last heard or asked; None for none."""
        return None if self._newest is None else self._newest.page

    def receive(self, page: int, content: object, now_s: float) -> None:
        """Take one message of the page of this number; what is invalid is refused whole, and counted."""
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
        """The page is gone."""
        self._expire(now_s)
        self._numbers.pop(page, None)
        for gone in (self._refused, self._giving_back):
            gone.discard(page)
        if page == self._driver:
            self._let_go()

    def hands(self, now_s: float) -> PageHands | None:
        """What the driving page's hands do, once they count; None while they rest, or nobody drives."""
        self._expire(now_s)
        return self._newest if self.doing is Doing.RUNNING else None

    def driven(self, now_s: float) -> bool:
        """Whether a page drives, its hands at rest or not."""
        self._expire(now_s)
        return self._driver is not None

    def stopping(self, now_s: float) -> bool:
        """Whether a page presses the emergency stop, whoever drives."""
        return self._stop_s is not None and now_s - self._stop_s < SILENCE_S

    def rest_anew(self) -> None:
        """All keys have to be up again first."""
        if self._driver is not None:
            self.doing, self._up_since_s = Doing.ALL_KEYS_UP_FIRST, None

    def take_give_back(self) -> bool:
        """Whether a page has let the scripted person go on since the last call."""
        given, self._give_back = self._give_back, False
        return given

    def follow(self, core: OperatorSide, now_s: float) -> None:
        """In every turn: a stop on a page counts like the controller's, and what a page wants tuned is asked for."""
        if self.stopping(now_s):
            core.press_stop(now_s)
        while self.wishes:
            wish = self.wishes.popleft()
            core.tune(wish.probability, wish.link, now_s)

    def facts(self, core: OperatorSide, now_s: float, *, person: bool) -> HandsFacts:
        """Facts for the pages; person: as in these."""
        self._expire(now_s)
        return HandsFacts(self.may_drive, self.driver, person, core.tuner.why, core.tuner.link)

    def _take(self, page: int, hands: PageHands, now_s: float) -> None:
        if hands.stop:  # however late it comes
            self._stop_s = now_s
            self.rest_anew()
        if hands.number <= self._numbers.get(page, -1):
            self.stale += 1
            return
        self._numbers[page] = hands.number
        self._choose(page, hands)
        if page == self._driver:
            self._newest, self._heard_s = hands, now_s
            self._follow(hands, now_s)

    def _choose(self, page: int, hands: PageHands) -> None:
        """Who drives after this message: nobody takes over from a page that does."""
        may_give_back = self._driver in (None, page) and page not in self._giving_back
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
            # It asks anew once it has let go of asking: nobody drives without meaning it.
            self._refused.add(page)

    def _follow(self, hands: PageHands, now_s: float) -> None:
        match self.doing:
            case Doing.ALL_KEYS_UP_FIRST:
                since_s = self._up_since_s
                if since_s is not None and now_s - since_s >= REST_S:
                    self.doing = Doing.READY
                    self._follow(hands, now_s)
                elif not hands.all_up:
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
