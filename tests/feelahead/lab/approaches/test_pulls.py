"""Pulls are the same for the same seed, stay within a finger's limits, and have the shapes that their names say."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind, force_for, make_pull
from operator_side.dualsense.simulated.trigger_model import SimulatedTrigger
from operator_side.hands.travel_calibration import TriggerTravel
from operator_side.people.port import FingerInput, Pull

STEP_S = 0.001
SEEDS = range(4)


def samples(pull: Pull, end_s: float = 19.0, step_s: float = STEP_S) -> list[FingerInput]:
    return [pull(step_s * number) for number in range(round(end_s / step_s))]


def settled_travel(force_n: float) -> float:
    """Return the calibrated travel at which a free trigger comes to rest under `force_n`."""
    trigger = SimulatedTrigger()
    trigger.set_finger_force(force_n)
    trigger.advance(5.0)
    return TriggerTravel().travel(trigger.sensed_travel)


@given(st.floats(0.0, 1.0))
def test_the_force_for_a_travel_holds_a_free_trigger_there(travel: float) -> None:
    assert settled_travel(force_for(travel)) == pytest.approx(travel, abs=1e-9)


@pytest.mark.parametrize("kind", PULL_KINDS)
def test_a_pull_is_that_of_its_seed_and_presses_r2_alone_no_harder_than_a_finger(kind: PullKind) -> None:
    first, pull = samples(make_pull(kind, 3), 5.0), make_pull(kind, 3)
    assert [pull(STEP_S * number) for number in reversed(range(len(first)))] == first[::-1]
    assert samples(make_pull(kind, 4), 5.0) != first
    for seed in SEEDS:
        seen = samples(make_pull(kind, seed), 25.0, 0.01)
        assert all(0.0 <= hands.r2_n <= (3.7 if kind == "on_off" else force_for(1.0)) for hands in seen)
        assert any(hands.r2_n > 0.5 for hands in seen)
        assert {hands.l2_n for hands in seen} == {0.0}
        if kind not in ("drift", "yaw", "swerve"):
            assert {(hands.left_stick, hands.right_stick) for hands in seen} == {((0.0, 0.0), (0.0, 0.0))}
