"""A controller that a person in a browser may take out of the scripted person's hands, and give back."""

from collections.abc import Callable
from typing import Final

from common.protocol.messages import Telemetry
from common.status.codes import Doing, Hands
from operator_side.controller.feel import Feel
from operator_side.controller.port import Controller
from operator_side.controller.state import ControllerState
from operator_side.people.whoever import Whoever
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage


class SharedHands:
    """The scripted person lets go as soon as a page drives or stops, and goes on only when told to: silence tells
    nothing. Whoever goes on is a new person, who believes nothing of what was before.

    As a controller it is the person's, or the page; both are told what to feel.
    """

    has_person: Final = True

    def __init__(
        self,
        pages: DrivingPage,
        page: BrowserHands,
        device: Controller,
        new_person: Callable[[], Whoever],
        let_go: Callable[[], None],
        calibrate: Callable[[], None],
    ) -> None:
        """`device` is held by who comes from `new_person`, until `let_go`, and read by what `calibrate` says."""
        self._pages, self._page, self._device = pages, page, device
        self._new_person, self._let_go, self._calibrate = new_person, let_go, calibrate
        self._person: Whoever | None = new_person()

    @property
    def hands(self) -> Hands:
        """Whose hands they are: the person's or a browser's."""
        return Hands.BROWSER if self._person is None else Hands.PERSON

    @property
    def doing(self) -> Doing:
        """What they do."""
        return (self._person or self._page).doing

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Move the hands; `delay_s` is the round trip that the person has got used to."""
        given_back = self._pages.take_give_back()
        if self._pages.stopping(now_s) or self._pages.driven(now_s):
            self._person = None
            self._let_go()
        elif given_back and self._person is None:
            self._person = self._new_person()
        if self._person is not None:
            self._calibrate()
        (self._person or self._page).tick(now_s, screen, delay_s)

    # The port

    @property
    def released(self) -> bool:
        """Both are."""
        return self._device.released and self._page.released

    def read(self, now_s: float) -> ControllerState | None:
        """The state by whose hands they are."""
        return (self._page if self._person is None else self._device).read(now_s)

    def write(self, feel: Feel, now_s: float) -> None:
        """Tell both: whoever goes on feels what there is."""
        self._device.write(feel, now_s)
        self._page.write(feel, now_s)

    def close(self) -> None:
        """Release both."""
        self._device.close()
        self._page.close()


MovedHands = BrowserHands | SharedHands
"""Hands that are moved in every turn."""
