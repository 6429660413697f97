from itertools import pairwise
from typing import Any

import msgspec
import pytest

from common.protocol.messages import Telemetry
from common.status.codes import InputSource
from operator_side.controller.feel import SENSED_TRAVEL, Feel
from operator_side.controller.state import Button, ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel
from operator_side.people.arming_hands import ArmingHands, constant_force
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.shared_hands import SharedHands
from tests.helpers.messages import feedback
from tests.helpers.simulated_desk import VIEW, armed
from tests.operator_side.viewing.pages.talking_page import PERIOD_S, TalkingPage

TICK_S = 0.004
WORN = TravelCalibration(
    TriggerTravel(0.2, 0.9), TriggerTravel(0.0, 0.7), StickRest(0.1, -0.05, 0.2), StickRest(-0.1, 0.1, 0.05)
)
"""Calibration of the scripted person's controller"""


class Desk:
    def __init__(self, *, swap_sides: bool = False, person: bool = False):
        self.swap_sides = swap_sides
        self.device = SimulatedDualSense()
        self.pages = DrivingPage()
        self.page = TalkingPage(self.pages)
        self.screen: Telemetry | None = VIEW
        self.people = 0
        self.calibrate(WORN)
        about = self.pages, self.calibrate
        self.hands = (
            SharedHands(*about, self.device, WORN, self.new_person, swap_sides=swap_sides)
            if person
            else BrowserHands(*about, swap_sides=swap_sides)
        )
        self.ticks = 0

    def calibrate(self, calibration: TravelCalibration) -> None:
        self.calibration = calibration

    def new_person(self) -> ArmingHands:
        self.people += 1
        return ArmingHands(self.device, constant_force(3.0))

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    def let_pass(self, for_s: float, says: bool = True, **hands: Any) -> list[OperatorIntent]:
        """Let the page send the same inputs, or nothing, for `for_s`; return the intents from its states."""
        meant = []
        for step in range(round(for_s / TICK_S)):
            if says and step % round(PERIOD_S / TICK_S) == 0:
                self.page.say(self.now_s, **hands)
            self.hands.tick(self.now_s, self.screen, 0.0)
            if (state := self.hands.read(self.now_s)) is not None:
                meant.append(operator_intent(state, self.calibration, swap_sides=self.swap_sides))
            self.ticks += 1
        return meant

    def arm(self) -> None:
        self.let_pass(1.1)
        assert any(one.arm for one in self.let_pass(0.1, run=True))
        self.screen = armed()
        assert not self.let_pass(0.1, run=True)[-1].arm


@pytest.mark.parametrize("person", [False, True])
@pytest.mark.parametrize("swap_sides", [False, True])
def test_travel_and_sticks_arrive_as_given(person: bool, swap_sides: bool) -> None:
    desk = Desk(swap_sides=swap_sides, person=person)
    desk.arm()
    given: dict[str, Any] = {"l2": 0.25, "r2": 0.75, "lateral": (0.3, -0.4), "turning": (-1.0, 0.0), "gripper": -1}
    meant = desk.let_pass(0.1, run=True, **given)[-1]
    assert (meant.l2, meant.r2, meant.turning) == (0.25, 0.75, (-1.0, 0.0))
    assert meant.lateral == pytest.approx((0.3, -0.4), abs=1e-15)
    assert (meant.run, meant.gripper, meant.emergency_stop) == (True, -1, False)


@pytest.mark.parametrize("person", [False, True])
def test_trigger_effects_change_no_travel_and_go_to_the_persons_device(person: bool) -> None:
    desk = Desk(person=person)
    desk.arm()
    stiff = Feel(l2=feedback(0, 8), r2=feedback(0, 8))
    desk.hands.write(stiff, desk.now_s)
    assert desk.let_pass(0.1, run=True, r2=1.0)[-1].r2 == 1.0
    assert not desk.hands.released
    assert not person or desk.device.strengths == (stiff.l2, stiff.r2)
    desk.hands.close()
    assert desk.hands.released


@pytest.mark.parametrize("swap_sides", [False, True])
def test_the_pull_of_keys_stops_where_a_finger_of_2_n_does(swap_sides: bool) -> None:
    desk = Desk(swap_sides=swap_sides)
    desk.arm()
    pull: dict[str, Any] = {"run": True, "r2": 1.0, "keyed": True}
    assert desk.let_pass(0.4, **pull)[-1].r2 == pytest.approx(1.0, abs=1e-3)
    desk.hands.write(Feel(l2=feedback(3, 8)) if swap_sides else Feel(r2=feedback(3, 8)), desk.now_s)
    assert desk.let_pass(0.4, **pull)[-1].r2 == pytest.approx(0.3 / SENSED_TRAVEL, abs=1e-3)
    assert desk.pages.yields == (swap_sides, not swap_sides)
    desk.hands.write(Feel(l2=feedback(0, 4)) if swap_sides else Feel(r2=feedback(0, 4)), desk.now_s)
    assert desk.let_pass(0.4, **pull)[-1].r2 == pytest.approx((2.0 - 0.5 - 4 * 0.25) / 4.0 / SENSED_TRAVEL, abs=1e-3)
    assert desk.let_pass(0.02, run=True)[-1].r2 == 0.0
    assert desk.pages.yields == (False, False)


def test_silence_releases_everything() -> None:
    desk = Desk()
    desk.arm()
    desk.let_pass(0.02, run=True, r2=1.0, lateral=(1.0, 0.0))
    after = desk.let_pass(1.0, says=False)
    assert {(one.r2, one.lateral, one.run) for one in after[round(0.31 / TICK_S) :]} == {(0.0, (0.0, 0.0), False)}
    assert after[round(0.1 / TICK_S)].run


def test_a_trigger_pulled_before_arming_counts_after_its_release() -> None:
    desk = Desk()
    desk.let_pass(1.1)
    assert {one.r2 for one in desk.let_pass(0.5, run=True, r2=1.0)} == {0.0}
    desk.screen = armed()
    assert {one.r2 for one in desk.let_pass(0.5, run=True, r2=1.0)} == {0.0}
    desk.let_pass(0.04, run=True)
    assert desk.let_pass(0.1, run=True, r2=1.0)[-1].r2 == 1.0


def test_the_arming_button_is_pressed_again_until_the_arm_is_armed_and_never_twice_in_a_press() -> None:
    desk = Desk()
    desk.let_pass(1.1)
    levels = [one.arm for one in desk.let_pass(1.6, run=True)]
    assert sum(not before and after for before, after in pairwise(levels)) >= 3
    desk.screen = armed()
    desk.let_pass(0.1, run=True)
    desk.screen = VIEW
    assert not any(one.arm or one.run for one in desk.let_pass(3.0, run=True)[1:])
    desk.let_pass(1.1)
    assert any(one.arm for one in desk.let_pass(0.1, run=True))


def test_an_unconfirmed_hold_arms_nothing() -> None:
    """The person may have let go while the page drew nothing."""
    desk = Desk()
    desk.let_pass(1.1)
    desk.let_pass(PERIOD_S, run=True)
    meant = desk.let_pass(0.6, run=True, age_s=0.2)
    assert all(one.run for one in meant)
    assert not any(one.arm for one in meant[round(0.1 / TICK_S) :])
    assert any(one.arm for one in desk.let_pass(1.0, run=True))


def test_the_person_lets_go_when_a_page_drives_and_silence_gives_nothing_back() -> None:
    desk = Desk(person=True)
    desk.let_pass(1.4, says=False)
    desk.screen = armed()
    desk.let_pass(1.0, says=False)
    assert (desk.hands.source, desk.hands.doing) == (InputSource.PERSON, "pulling")
    assert desk.let_pass(0.004, says=False)[-1].r2 > 0.5
    after = desk.let_pass(0.1)
    assert {(one.r2, one.run) for one in after[1:]} == {(0.0, False)}
    silent = desk.let_pass(5.0, says=False)
    assert {(one.r2, one.run) for one in silent} == {(0.0, False)}
    assert (desk.hands.source, desk.people) == (InputSource.BROWSER, 1)
    desk.page.say(desk.now_s, driving=False, give_back=True)
    first = desk.let_pass(0.1, says=False)
    assert (desk.hands.source, desk.hands.doing, desk.people) == (InputSource.PERSON, "resting", 2)
    assert (first[0].r2, first[0].arm) == (0.0, False)


def test_a_stop_takes_the_controller_from_the_person_for_good() -> None:
    desk = Desk(person=True)
    desk.let_pass(1.3, says=False)
    desk.page.say(desk.now_s, driving=False, stop=True)
    assert not any(one.arm for one in desk.let_pass(10.0, says=False)[1:])
    assert desk.hands.source == InputSource.BROWSER
    alone = Desk()
    alone.page.say(0.0, driving=False, give_back=True)
    assert not any(one.run for one in alone.let_pass(3.0, says=False))
    assert (alone.hands.source, alone.hands.has_person) == (InputSource.BROWSER, False)


def test_a_stop_from_elsewhere_needs_a_reset_too_and_hold_to_run_does_not_arm_before_it() -> None:
    desk = Desk()
    desk.arm()
    desk.screen = msgspec.structs.replace(VIEW, state="stopped")
    desk.let_pass(1.3)
    assert not any(one.arm or one.run for one in desk.let_pass(1.0, run=True))
    desk.let_pass(0.02, reset=True)
    desk.let_pass(1.1)
    assert any(one.arm for one in desk.let_pass(0.5, run=True))


def test_the_hands_press_no_button_that_was_not_asked_for() -> None:
    desk = Desk()
    desk.screen = armed()
    [first, *_] = desk.let_pass(0.02, says=False)
    assert first == operator_intent(ControllerState())
    desk.let_pass(1.1)
    held = desk.let_pass(0.02, run=True, next_target=True, hand_over=True)[-1]
    assert held == operator_intent(ControllerState(pressed=frozenset({Button.L1, Button.TRIANGLE, Button.CREATE})))
