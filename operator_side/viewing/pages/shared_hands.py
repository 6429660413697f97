"""A simulated controller that a person in a browser may take out of the scripted person's hands, and give back."""

from collections.abc import Callable

from common.protocol.messages import Telemetry
from common.status.codes import Doing, Hands
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.whoever import Whoever
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage


class SharedHands:
    """The scripted person lets go as soon as a page drives or stops, and goes on only when told to: silence tells
    nothing. Whoever goes on is a new person, who believes nothing of what was before.
    """

    def __init__(
        self,
        device: SimulatedDualSense,
        pages: DrivingPage,
        new_person: Callable[[], Whoever] | None,
        calibration: TravelCalibration | None = None,
        *,
        swap_sides: bool = False,
    ) -> None:
        """`new_person`: None where nobody but a page ever drives."""
        self._pages = pages
        self._new_person = new_person
        self._person = None if new_person is None else new_person()
        self._browser = BrowserHands(device, pages, calibration, swap_sides=swap_sides)

    @property
    def has_person(self) -> bool:
        """Whether there is a scripted person who could go on."""
        return self._new_person is not None

    @property
    def hands(self) -> Hands:
        """Whose hands they are: the person's or a browser's."""
        return Hands.BROWSER if self._person is None else Hands.PERSON

    @property
    def doing(self) -> Doing:
        """What they do."""
        return self._browser.doing if self._person is None else self._person.doing

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Move the hands; `delay_s` is the round trip that the person has got used to."""
        given_back = self._pages.take_give_back()
        if self._pages.stopping(now_s) or self._pages.driven(now_s):
            self._person = None
        elif given_back and self._person is None and self._new_person is not None:
            self._browser.release()
            self._person = self._new_person()
            return
        (self._browser if self._person is None else self._person).tick(now_s, screen, delay_s)
