"""Simulated controller of the scripted person, which an operator in a browser may take over and hand back."""

from collections.abc import Callable

from common.protocol.messages import Telemetry
from common.status.codes import Doing, InputSource
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.simulated_hands import SimulatedHands
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage


class SharedHands(BrowserHands):
    """Controller used by the scripted person until a page drives or presses the emergency stop.

    The scripted person continues only when a page hands the controls back, never because the page is silent. Then a
    new person begins, without memory. States come from the person's simulated DualSense or from the page; each write
    goes to both.
    """

    has_person = True

    def __init__(
        self,
        pages: DrivingPage,
        calibrate: Callable[[TravelCalibration], None],
        device: SimulatedDualSense,
        calibration: TravelCalibration,
        new_person: Callable[[], SimulatedHands],
        *,
        swap_sides: bool = False,
    ) -> None:
        """device: controller that the result of `new_person` operates. calibration: calibration of `device`."""
        super().__init__(pages, calibrate, swap_sides=swap_sides)
        self._device, self._calibration, self._new_person = device, calibration, new_person
        self._person: SimulatedHands | None = new_person()

    @property
    def source(self) -> InputSource:
        """Owner of the controls: the scripted person or a browser."""
        return InputSource.BROWSER if self._person is None else InputSource.PERSON

    @property
    def doing(self) -> Doing:
        """Present action of the scripted person, or of the operator at the page."""
        return super().doing if self._person is None else self._person.doing

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Move the inputs of the present owner. delay_s: round trip that the scripted person has learned to expect."""
        given_back = self._pages.take_give_back()
        if self._pages.stopping(now_s) or self._pages.driven(now_s):
            self._person = None
            self._device.hands_off()
        elif given_back and self._person is None:
            self._person = self._new_person()
        if self._person is None:
            super().tick(now_s, screen, delay_s)
        else:
            self._calibrate(self._calibration)
            self._person.tick(now_s, screen, delay_s)

    # Interface of `Controller` (operator_side/controller/port.py)

    @property
    def released(self) -> bool:
        """Whether the simulated DualSense and the page are released."""
        return self._device.released and super().released

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state of the present owner's controller."""
        return super().read(now_s) if self._person is None else self._device.read(now_s)

    def write(self, feel: Feel, now_s: float) -> None:
        """Write to the simulated DualSense and to the page, so that the next owner feels the present effects."""
        self._device.write(feel, now_s)
        super().write(feel, now_s)

    def close(self) -> None:
        """Release the simulated DualSense and the page."""
        self._device.close()
        super().close()
