"""Choice of the page that drives, and whether its inputs move the arm.

A browser may miss that a key was released, which must never move the arm. So the inputs count only while running:

nobody ─▶ resting ─▶ ready ─▶ running         the first page that asks to drive becomes the driving page
             ▲         │         │            resting: all keys must be up for 1 s; ready: hold-to-run counts
             └─────────┴─────────┘  on another key before hold-to-run, hold-to-run released, a stop, a disarmed arm

After a stop the inputs rest until the stop is reset: hold-to-run alone never arms again.
After 300 ms of silence, or when the driving page stops driving or closes, nobody drives; the next page rests first.

A key may come up unseen while the page's drawing is late. So unconfirmed inputs count in full for 150 ms, and less and
less until 300 ms, whether the page is late or silent. A key that came up moves the arm for at most 0.225 s of its
speed: at 250 mm/s, 19 mm more than if it ended at 150 ms. After a second all keys must be up.
"""

from collections import deque
from typing import Final

import msgspec

from common.episode import EpisodeMark
from common.status.codes import Doing
from operator_side.core import OperatorSide
from operator_side.viewing.facts import HandsFacts
from operator_side.viewing.pages.pace import PagePace
from operator_side.viewing.pages.page_messages import PageHands, PageMessage, TuneWish
from operator_side.viewing.pages.pictures import Pictures

IN_FULL_S, SILENCE_S = 0.15, 0.3
"""Age of unconfirmed inputs up to which they count in full, and from which they move nothing. After `SILENCE_S` without
any message a page no longer drives, and its emergency stop counts as released."""
ABSENT_S, FROZEN_S = 1.0, 3.0
"""Age of unconfirmed inputs after which all keys must be up first, and after which another page may drive"""
_RISE_S: Final = 0.5
"""Time in which inputs count again once they are confirmed, in seconds"""
REST_S: Final = 1.0
"""Seconds for which all keys must be up before hold-to-run counts."""
_MOST_WISHES: Final = 16
"""Maximum number of tuning requests, and of marks, kept between two turns of the loop."""


class DrivingPage:
    """Receives pages' messages and chooses the driving page. `now_s` is a message's time of arrival."""

    def __init__(self, *, may_drive: bool = True) -> None:
        """may_drive: False if a real controller drives; pages can then only stop the arm and tune."""
        self.may_drive = may_drive
        self.rejected = 0
        """Number of invalid messages."""
        self.pictures = Pictures()
        """Freshness of what pages show"""
        self.stale = 0
        """Number of messages that arrived after a newer one of the same page; of these only the stop counts."""
        self.silences = 0
        """Number of times that a driving page was silent for too long"""
        self._numbers: dict[int, int] = {}
        """Sequence number of the newest message of each open page"""
        self._refused: set[int] = set()
        self._driver: int | None = None
        self._newest: PageHands | None = None
        self._heard_s = self._asked_s = 0.0
        self._confirmed = 1.0
        """Share of the inputs that counts, as far as the page confirms them"""
        self._latest_s = 0.0
        """Greatest age of unconfirmed inputs since all counted"""
        self._cause = ""
        """Words before that age"""
        self.released = ""
        """Why inputs were released without the page's doing, as in HandsFacts"""
        self.pace = PagePace()
        """Rates that the pages keep up with"""
        self._up_since_s: float | None = None
        self.doing = Doing.NOBODY_DRIVES
        """Present action of the driving page, as of the last call"""
        self._stop_s: float | None = None
        self.reset_first = False
        """Whether a stop waits for its reset, so that no page's hands count"""
        self.yields = (False, False)
        """For L2 and R2, whether the pull of the driving page's keys yields to stiff zones, by `BrowserHands`"""
        self._giving_back: set[int] = set()
        self._give_back = False
        self.wishes: deque[TuneWish] = deque(maxlen=_MOST_WISHES)
        self._marks: deque[EpisodeMark] = deque(maxlen=_MOST_WISHES)

    @property
    def driver(self) -> str | None:
        """Word that identifies the driving page, as of the last call; None if no page drives."""
        return None if self._newest is None else self._newest.page

    def receive(self, page: int, content: object, now_s: float) -> None:
        """Take one message of the page with the number `page`; an invalid message is counted and otherwise ignored."""
        self._expire(now_s)
        try:
            message = msgspec.convert(content, PageMessage)
        except msgspec.ValidationError:
            self.rejected += 1
            return
        if message.tune is not None:
            self.wishes.append(message.tune)
        if message.mark is not None:
            self._marks.append(message.mark)
        if message.hands is not None:
            self._take(page, message.hands, now_s)

    def close(self, page: int, now_s: float) -> None:
        """Forget a page that has closed."""
        self._expire(now_s)
        self._numbers.pop(page, None)
        for gone in (self._refused, self._giving_back):
            gone.discard(page)
        if page == self._driver:
            self._let_go()

    def hands(self, now_s: float) -> PageHands | None:
        """Return the driving page's inputs while they count (running); None otherwise."""
        self._expire(now_s)
        passed_s, self._asked_s = now_s - self._asked_s, now_s
        if self.doing is not Doing.RUNNING or self._newest is None:
            self._confirmed, self._latest_s = 1.0, 0.0
            return None
        age_s = self._newest.age_s + now_s - self._heard_s
        share = min(1.0, max(0.0, (SILENCE_S - age_s) / (SILENCE_S - IN_FULL_S)))
        self._confirmed = min(share, self._confirmed + passed_s / _RISE_S)
        if share < 1.0:
            repeated = self._newest.age_s > IN_FULL_S
            self._cause = "this page is late by" if repeated else "nothing came from this page for"
        self._latest_s = 0.0 if self._confirmed == 1.0 else max(self._latest_s, age_s)
        return self._newest

    @property
    def confirmed(self) -> bool:
        """Whether the page's drawing thread confirmed the inputs just now, so that they count in full."""
        return self._confirmed == 1.0

    @property
    def counts(self) -> float:
        """Share of the inputs that counts: less while the pictures are old, or the inputs are not confirmed."""
        return min(self.pictures.hands, self._confirmed)

    @property
    def because(self) -> str:
        """Why less than all counts, with what was measured; empty if all counts."""
        if self._confirmed < self.pictures.hands:
            return f"{self._cause} {1e3 * self._latest_s:.0f} ms"
        return self.pictures.because

    def driven(self, now_s: float) -> bool:
        """Return whether there is a driving page, even if its inputs do not count yet."""
        self._expire(now_s)
        return self._driver is not None

    def stopping(self, now_s: float) -> bool:
        """Return whether any page holds the emergency stop down."""
        return self._stop_s is not None and now_s - self._stop_s < SILENCE_S

    def rest_anew(self) -> None:
        """Require all keys to be up for 1 s again before hold-to-run counts."""
        if self._driver is not None:
            self.doing, self._up_since_s = Doing.ALL_KEYS_UP_FIRST, None

    def require_reset(self) -> None:
        """Let no page's hands count before a reset, as the arm was stopped."""
        self.reset_first = self.may_drive
        self.rest_anew()

    def take_give_back(self) -> bool:
        """Return whether a page has handed the controls back to the scripted person since the last call."""
        given, self._give_back = self._give_back, False
        return given

    def apply(self, core: OperatorSide, now_s: float) -> None:
        """Apply the pages' emergency stops, tuning requests and marks; call it in every turn of the loop."""
        self.pictures.update(core, None if self._newest is None else self._newest.shown_s, now_s)
        if self.stopping(now_s):
            core.press_stop(now_s)
        while self.wishes:
            wish = self.wishes.popleft()
            core.tune(wish.probability, wish.link, now_s)
        while self._marks:
            core.marker.mark(self._marks.popleft(), now_s)

    def facts(self, core: OperatorSide, now_s: float, *, person: bool) -> HandsFacts:
        """Return the facts for the pages. person: whether they may hand the controls back to a scripted person."""
        self._expire(now_s)
        known = (self.may_drive, self.driver, person, core.tuner.why, core.tuner.link)
        pace = self.pace.because, self.pace.seldom
        return HandsFacts(*known, self.counts, self.reset_first, self.yields, self.because, self.released, *pace)

    def _take(self, page: int, hands: PageHands, now_s: float) -> None:
        if hands.stop and hands.age_s <= ABSENT_S:  # even an overtaken one; a frozen page repeats it for ever
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
            self._advance(hands, now_s)

    def _choose(self, page: int, hands: PageHands) -> None:
        """Update the driving page by this message. No page can take over from a page that drives."""
        may_give_back = self._driver in (None, page) and page not in self._giving_back and not self.reset_first
        (self._giving_back.add if hands.give_back else self._giving_back.discard)(page)
        if hands.give_back and may_give_back:
            self._give_back = True
        if not hands.driving or hands.give_back:
            self._refused.discard(page)
            if page == self._driver:
                self._let_go()
        elif self._driver is None and self.may_drive and page not in self._refused and hands.age_s <= IN_FULL_S:
            self._driver = page
            self.doing, self._up_since_s = Doing.ALL_KEYS_UP_FIRST, None
        elif page != self._driver:
            # A refused page must stop asking before it may ask again, so that it does not drive by surprise later.
            self._refused.add(page)

    def _advance(self, hands: PageHands, now_s: float) -> None:
        match self.doing:
            case Doing.ALL_KEYS_UP_FIRST:
                since_s = self._up_since_s
                if since_s is not None and now_s - since_s >= REST_S:
                    self.doing = Doing.READY
                    self._advance(hands, now_s)
                elif self.reset_first or not hands.all_up or hands.age_s > IN_FULL_S:
                    self._up_since_s = None
                elif since_s is None:
                    self._up_since_s = now_s
            case Doing.READY:
                if hands.run and not hands.stop:
                    self.doing, self.released = Doing.RUNNING, ""
                elif not hands.all_up:
                    self.rest_anew()
            case Doing.RUNNING:
                if not hands.run or hands.stop:
                    self.rest_anew()

    def _expire(self, now_s: float) -> None:
        if self._driver is None or self._newest is None:
            return
        silent_s = now_s - self._heard_s
        if silent_s > SILENCE_S:
            self.silences += 1
            self.released = f"Nothing came from this page for {1e3 * silent_s:.0f} ms."
            self._let_go()
        elif (late_s := silent_s + self._newest.age_s) > FROZEN_S or (
            self.doing is Doing.RUNNING and late_s > ABSENT_S
        ):
            self.silences += 1
            self.released = f"This page was late by {1e3 * late_s:.0f} ms."
            if late_s > FROZEN_S:
                self._let_go()
            else:
                self.rest_anew()

    def _let_go(self) -> None:
        self._driver = self._newest = self._up_since_s = None
        self.doing = Doing.NOBODY_DRIVES
