from dataclasses import replace

import pytest

from operator_side.controller.state import Button, ControllerState
from operator_side.hands.button_map import BUTTON_OF
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel


def pressing(*buttons: Button) -> OperatorIntent:
    return operator_intent(ControllerState(pressed=frozenset(buttons)))


@pytest.mark.parametrize(("l2", "r2", "released"), [(0.04, 0.05, True), (0.06, 0.0, False), (0.0, 1.0, False)])
def test_released_means_within_the_dead_zone(l2: float, r2: float, released: bool) -> None:
    assert operator_intent(ControllerState(l2=l2, r2=r2)).triggers_released is released


def test_every_other_button_does_nothing() -> None:
    unused = [button for button in Button if button not in BUTTON_OF.values()]
    assert len(unused) == len(Button) - len(BUTTON_OF)
    for button in unused:
        assert pressing(button) == pressing()


def test_both_gripper_buttons_hold() -> None:
    assert pressing(Button.CROSS, Button.SQUARE).gripper == 0


def test_swapped_sides_swap_triggers_sticks_and_l1_and_nothing_else() -> None:
    calibration = TravelCalibration(l2=TriggerTravel(0.1, 0.5), r2=TriggerTravel(0.3, 0.9))
    state = ControllerState(
        l2=0.3,
        r2=0.6,
        left_stick=(1.0, 0.0),
        right_stick=(0.0, -1.0),
        pressed=frozenset({Button.R1, Button.CROSS}),
    )
    plain = operator_intent(state, calibration)
    swapped = operator_intent(state, calibration, swap_sides=True)
    # Each trigger keeps its own calibration; only the triggers' purposes are swapped.
    assert (plain.l2, plain.r2) == pytest.approx((0.5, 0.5))
    assert (swapped.l2, swapped.r2) == (plain.r2, plain.l2)
    assert (swapped.lateral, swapped.turning) == (plain.turning, plain.lateral)
    assert (plain.run, swapped.run) == (False, True)
    assert swapped.gripper == plain.gripper == 1
    assert not operator_intent(ControllerState(pressed=frozenset({Button.L1})), swap_sides=True).run


def test_what_moves_rests_and_the_other_buttons_stay() -> None:
    moving = OperatorIntent(
        0.4, 0.7, (0.2, 0.3), (-0.2, 0.1), gripper=1, home=1.0, arm=True, run=True, emergency_stop=True, hand_over=True
    )
    resting = moving.resting()
    assert resting == OperatorIntent(run=True, emergency_stop=True, hand_over=True, raw=moving.raw)
    assert resting.rests
    for one in (replace(resting, l2=0.1), replace(resting, lateral=(0.0, -1.0)), replace(resting, turning=(1.0, 0.0))):
        assert not one.rests
