"""A browser's hands on a simulated controller: what they do goes the way of any controller's hands."""

from typing import Final

from common.protocol.messages import Telemetry, Vector2
from common.status.codes import Doing, Readiness
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.button_map import Action, button_of
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.page_messages import PageHands

_PRESS_S: Final = 0.2
"""For so long the arming button is pressed, and then let go, until the arm is armed: each press is another edge."""
_REST: Final[Vector2] = (0.0, 0.0)
_GRIPPER: Final = {1: Action.CLOSE_GRIPPER, -1: Action.OPEN_GRIPPER}


class BrowserHands:
    """Hold-to-run arms, once per press; what moves the arm counts from when it was seen at rest while armed."""

    def __init__(
        self,
        device: SimulatedDualSense,
        pages: DrivingPage,
        calibration: TravelCalibration | None = None,
        *,
        swap_sides: bool = False,
    ) -> None:
        self._device = device
        self._pages = pages
        self._calibration = calibration or TravelCalibration()
        self._swap_sides = swap_sides
        self._began_s: float | None = None
        self._was_armed = False
        self._moves = False

    @property
    def doing(self) -> Doing:
        """What they do."""
        if self._pages.readiness is not Readiness.RUNNING or self._moves:
            return Doing(self._pages.readiness)
        return Doing.AT_REST_FIRST if self._was_armed else Doing.ARMING

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Do with the controller what the page's hands do; the screen says whether the arm is armed."""
        del delay_s
        hands = self._pages.hands(now_s)
        armed = screen is not None and screen.state == "armed"
        if hands is not None and self._was_armed and not armed:
            # It stopped under these hands: it arms again when they have rested, not by itself.
            self._pages.rest_anew()
            hands = None
        if hands is None:
            self._began_s, self._was_armed, self._moves = None, False, False
            self.release()
            return
        if self._began_s is None:
            self._began_s = now_s
        self._was_armed |= armed
        self._moves |= armed and hands.moves_nothing
        pressed = {Action.RUN}
        if not armed and (now_s - self._began_s) % (2.0 * _PRESS_S) < _PRESS_S:
            pressed.add(Action.ARM)
        self._act(hands, pressed)

    def release(self) -> None:
        """Take the hands off the controller."""
        self._device.set_travel(0.0, 0.0)
        self._device.set_sticks(self._calibration.left_stick.raw(_REST), self._calibration.right_stick.raw(_REST))
        self._device.set_buttons(frozenset())

    def _act(self, hands: PageHands, pressed: set[Action]) -> None:
        chosen = {Action.NEXT_TARGET: hands.next_target, Action.HAND_OVER: hands.hand_over}
        pressed |= {action for action, is_pressed in chosen.items() if is_pressed}
        travel, sticks = (0.0, 0.0), (_REST, _REST)
        if self._moves:
            travel, sticks = (hands.l2, hands.r2), (hands.lateral, hands.turning)
            if hands.gripper in _GRIPPER:
                pressed.add(_GRIPPER[hands.gripper])
        order = -1 if self._swap_sides else 1
        calibration = self._calibration
        l2, r2 = travel[::order]
        left, right = sticks[::order]
        self._device.set_travel(_raw(calibration.l2, l2), _raw(calibration.r2, r2))
        self._device.set_sticks(calibration.left_stick.raw(left), calibration.right_stick.raw(right))
        button = button_of(swap_sides=self._swap_sides)
        self._device.set_buttons(frozenset(button[action] for action in pressed))


def _raw(calibrated: TriggerTravel, travel: float) -> float:
    return calibrated.raw(travel) if travel > 0.0 else 0.0
