import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.calibration.procedure import CalibrationError, CalibrationProcedure, Step
from operator_side.controller.state import ControllerState
from tests.helpers.calibrating_hands import REPORT_S, CalibratingUser, Wear

ENDS = st.tuples(st.floats(0.0, 0.2), st.floats(0.7, 1.0))
PLACES = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))


def test_a_worn_controller() -> None:
    wear = Wear(l2=(0.1, 0.9), r2=(0.0, 0.8), left=((0.04, -0.02), (0.08, -0.02)), noise=0.01)
    result = CalibratingUser(wear).run().result
    assert result is not None
    assert result.l2.dead_zone == pytest.approx(0.13, abs=0.002)
    assert result.l2.saturation == pytest.approx(0.87, abs=0.012)
    assert result.r2.saturation == pytest.approx(0.77, abs=0.012)
    assert (result.left_stick.x, result.left_stick.y) == pytest.approx((0.06, -0.02), abs=2e-3)
    assert 0.06 < result.left_stick.dead_zone < 0.07


@given(ENDS, ENDS, PLACES, PLACES, st.floats(0.0, 0.014), st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_the_result_makes_rest_zero_and_a_full_pull_one(
    l2: tuple[float, float],
    r2: tuple[float, float],
    before: tuple[float, float],
    after: tuple[float, float],
    noise: float,
    seed: int,
) -> None:
    wear = Wear(l2, r2, (before, after), (after, before), noise)
    result = CalibratingUser(wear, seed=seed).run().result
    assert result is not None
    for trigger, (rest, end) in ((result.l2, l2), (result.r2, r2)):
        assert trigger.travel(min(1.0, rest + noise)) == 0.0
        assert trigger.travel(max(0.0, end - noise)) == 1.0
    for stick in (result.left_stick, result.right_stick):
        for x, y in (before, after):
            assert stick.deflection((x, y)) == (0.0, 0.0)
        assert math.hypot(*stick.deflection((1.0, 0.0))) == pytest.approx(1.0)


def test_the_steps_come_in_order_and_tell_what_to_do() -> None:
    hands = CalibratingUser(Wear())
    steps = [hands.procedure.step]
    while hands.procedure.step is not Step.DONE:
        hands.run(hands.now_s + 0.1)
        assert 0.0 <= hands.procedure.progress <= 1.0
        if hands.procedure.step is not steps[-1]:
            steps.append(hands.procedure.step)
    assert steps == list(Step)
    assert hands.complaints == []
    hands.procedure.feed(ControllerState(l2=1.0), hands.now_s)
    assert hands.procedure.step is Step.DONE


def test_pulls_that_disagree_are_asked_for_again_and_then_refused() -> None:
    hands = CalibratingUser(Wear(), lambda _, number: 0.7 if number == 1 else 1.0)
    assert hands.run().result is not None
    assert any("0.70" in complaint and "again, three times" in complaint for complaint in hands.complaints)
    with pytest.raises(CalibrationError, match=r"the pulls of R2 ended at .*0\.70.*3 attempts"):
        CalibratingUser(Wear(), lambda trigger, number: 0.7 if trigger == "r2" and number % 2 else 1.0).run()


def test_the_wrong_trigger_is_pointed_out_and_does_not_count() -> None:
    hands = CalibratingUser(Wear())
    while hands.procedure.step is not Step.PULL_L2:
        hands.run(hands.now_s + REPORT_S)
    for r2 in (0.0, 0.5, 1.0, 0.5, 0.0):
        hands.procedure.feed(ControllerState(r2=r2), hands.now_s)
    assert hands.procedure.complaint == "R2 is pulled; release it and pull L2"
    assert hands.procedure.progress == 0.0


def test_a_hand_on_the_stick_is_no_rest() -> None:
    procedure, complaints = CalibrationProcedure(), set()
    for tick in range(1000):
        procedure.feed(ControllerState(left_stick=(0.3 * math.sin(0.03 * tick), 0.0)), tick * REPORT_S)
        complaints.add(procedure.complaint)
    assert procedure.step is Step.REST
    assert "the left stick is being moved" in complaints


def test_what_never_rests_is_refused() -> None:
    procedure = CalibrationProcedure()

    def shake() -> None:
        for tick in range(1000):
            procedure.feed(ControllerState(l2=0.4 * (tick % 2)), tick * 0.1)

    with pytest.raises(
        CalibrationError, match=r"after 60 s this step was not done: Put the controller down.*L2 is being"
    ):
        shake()


@pytest.mark.parametrize(
    ("wear", "pull", "why"),
    [
        (Wear(l2=(0.3, 1.0)), 1.0, r"L2 rests at 0\.30"),
        (Wear(r2=(0.26, 1.0)), 1.0, r"R2 rests at 0\.26"),
        (Wear(right=((0.4, 0.0), (0.4, 0.0))), 1.0, "the right stick rests at"),
        (Wear(left=((-0.3, 0.0), (0.3, 0.0))), 1.0, "the left stick rested at"),
        # The highest rest and the smallest pull, each of which is accepted by itself.
        (Wear(l2=(0.25, 0.5)), 1.0, r"L2 rests at 0\.25 and ends at 0\.50: its travel is too short"),
        (Wear(), 0.45, r"the pulls of L2 ended at 0\.45, 0\.45, 0\.45; valid: 0\.5"),
        (Wear(), 0.0, "not done: Pull L2"),
    ],
)
def test_what_is_broken_is_refused_with_its_reason(wear: Wear, pull: float, why: str) -> None:
    with pytest.raises(CalibrationError, match=why):
        CalibratingUser(wear, lambda *_: pull).run()
