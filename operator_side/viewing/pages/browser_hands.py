"""Console page as a controller: the inputs at the page become a controller's state.

The zones' strengths act on what keys pull, as on a finger of 2 N; a gamepad at the page is pulled by a real finger.
"""

import math
from collections.abc import Callable
from typing import Final

from common.protocol.messages import Telemetry
from common.status.codes import Doing, InputSource
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel
from operator_side.controller.state import ControllerState
from operator_side.hands.button_map import Action, button_of
from operator_side.hands.travel_calibration import IDENTITY, TravelCalibration
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.page_messages import PageHands
from operator_side.viewing.pages.yielding_pull import YieldingPull

_PRESS_S: Final = 0.2
"""Seconds for which the arming button is pressed, then released, and so on until the arm is armed"""
_MOVES_GRIPPER: Final = 0.5
"""Share of the hands that must count for the gripper, or the arm on its way home, to move"""
_BUTTONS: Final = {
    "next_target": Action.NEXT_TARGET,
    "next_speed": Action.NEXT_SPEED,
    "next_frame": Action.NEXT_FRAME,
    "home": Action.HOME,
    "hand_over": Action.HAND_OVER,
}
_GRIPPER: Final = {1: Action.CLOSE_GRIPPER, -1: Action.OPEN_GRIPPER}


class BrowserHands:
    """Controller made of a page's inputs.

    Each press of hold-to-run may arm the arm once. Triggers and sticks count once all were at rest while it was armed.
    """

    has_person = False
    """Whether a page may hand the controls back to a scripted person."""

    def __init__(
        self, pages: DrivingPage, calibrate: Callable[[TravelCalibration], None], *, swap_sides: bool = False
    ) -> None:
        """calibrate: called with the calibration for the states of `read`: IDENTITY, as a page has no dead zones."""
        self._pages = pages
        self._calibrate = calibrate
        self._swap_sides = swap_sides
        self._began_s: float | None = None
        self._was_armed = self._was_stopped = False
        self._moves = False
        self._state = ControllerState()
        self._commanded = RELEASED
        self._pulls = YieldingPull(), YieldingPull()
        self._ticked_s = -math.inf

    @property
    def source(self) -> InputSource:
        """Owner of the controls: a browser."""
        return InputSource.BROWSER

    @property
    def doing(self) -> Doing:
        """Present action of the operator at the page."""
        if self._pages.doing is not Doing.RUNNING or self._moves:
            return self._pages.doing
        return Doing.AT_REST_FIRST if self._was_armed else Doing.ARMING

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Make the controller's state from the page's inputs. screen: telemetry, which has the arm's state."""
        del delay_s
        passed_s, self._ticked_s = now_s - self._ticked_s, now_s
        self._calibrate(IDENTITY)
        self._pages.yields = (False, False)
        stopped = self._was_stopped if screen is None else screen.state == "stopped"
        if stopped and not self._was_stopped:
            self._pages.require_reset()
        self._was_stopped = stopped
        hands = self._pages.hands(now_s)
        armed = screen is not None and screen.state == "armed"
        if hands is not None and self._was_armed and not armed:
            # The arm stopped while this page drove: all keys must come up before hold-to-run arms it again.
            self._pages.rest_anew()
            hands = None
        if hands is None:
            self._began_s, self._was_armed, self._moves = None, False, False
            self._state = ControllerState()
            return
        if self._began_s is None:
            self._began_s = now_s
        self._was_armed |= armed
        self._moves |= armed and hands.moves_nothing
        pressed = {Action.RUN}
        # An unconfirmed hold may have ended: it keeps the arm armed for a while, but arms nothing.
        if not armed and self._pages.confirmed and (now_s - self._began_s) % (2.0 * _PRESS_S) < _PRESS_S:
            pressed.add(Action.ARM)
        self._state = self._held(hands, pressed, passed_s)

    # Interface of `Controller` (operator_side/controller/port.py)

    @property
    def released(self) -> bool:
        """Whether the last write neither resists nor rumbles; a page only shows resistance and rumble."""
        return self._commanded.releases

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state that the last `tick` made."""
        del now_s
        return self._state

    def write(self, feel: Feel, now_s: float) -> None:
        """Store `feel`; a page has nothing to write it to."""
        del now_s
        self._commanded = feel.completed_from(self._commanded)

    def close(self) -> None:
        """Store the release: there is no device to close."""
        self._commanded = self._commanded.farewell

    def _held(self, hands: PageHands, pressed: set[Action], passed_s: float) -> ControllerState:
        pressed |= {action for name, action in _BUTTONS.items() if getattr(hands, name)}
        counts = self._pages.counts
        if not self._moves or counts <= _MOVES_GRIPPER:
            pressed.discard(Action.HOME)
        elif hands.gripper in _GRIPPER:
            pressed.add(_GRIPPER[hands.gripper])
        button = button_of(swap_sides=self._swap_sides)
        held = frozenset(button[action] for action in pressed)
        if not self._moves:
            return ControllerState(pressed=held)
        order = -1 if self._swap_sides else 1
        l2, r2 = (counts * hands.l2, counts * hands.r2)[::order]
        if hands.keyed:
            l2, r2 = self._pulled((l2, r2), passed_s)
        left, right = ((counts * x, counts * y) for x, y in (hands.lateral, hands.turning)[::order])
        return ControllerState(left, right, l2, r2, held)

    def _pulled(self, asked: tuple[float, float], passed_s: float) -> tuple[float, float]:
        """Return the raw travels of L2 and R2 to which keys that ask for `asked` pull them."""
        l2, r2 = self._pulls
        travels = (
            l2.travel(asked[0], self._commanded.l2 or FREE_TRIGGER, passed_s),
            r2.travel(asked[1], self._commanded.r2 or FREE_TRIGGER, passed_s),
        )
        self._pages.yields = (l2.yields, r2.yields)
        return travels
