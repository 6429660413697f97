"""Pulls are the same for the same seed, stay within a finger's limits, and have the shapes that their names say."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.messages import Vector2
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind, force_for, make_pull
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import SimulatedTrigger
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from operator_side.people.pulling_hands import Hands, Pull

STEP_S = 0.001
SEEDS = range(4)


def samples(pull: Pull, end_s: float = 19.0, step_s: float = STEP_S) -> list[Hands]:
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


@pytest.mark.parametrize(
    ("kind", "pressed_s", "resting_s", "peaks_n"),
    [
        ("bell", (0.7, 1.4), (0.1, 0.4), (force_for(0.5), force_for(1.0))),
        ("on_off", (0.3, 0.7), (0.2, 0.5), (2.0, 3.7)),
    ],
)
@pytest.mark.parametrize("seed", SEEDS)
def test_presses_and_rests_are_as_long_and_strong_as_said_and_the_trigger_comes_to_rest(
    kind: PullKind,
    seed: int,
    pressed_s: tuple[float, float],
    resting_s: tuple[float, float],
    peaks_n: tuple[float, float],
) -> None:
    trigger, told = SimulatedTrigger(), []
    for hands in samples(make_pull(kind, seed)):
        trigger.set_finger_force(hands.r2_n)
        trigger.advance(STEP_S)
        told.append((hands.r2_n, TriggerTravel().travel(trigger.sensed_travel)))
    phases = [list(run) for _, run in itertools.groupby(told, key=lambda one: one[0] > 0.0)]
    # A bell's first and last millisecond have no force. The last phase is cut off.
    phases = phases[1 if phases[0][0][0] == 0.0 else 0 : -1]
    assert len(phases) >= 18
    for phase in phases:
        least_s, most_s = pressed_s if phase[0][0] > 0.0 else resting_s
        assert least_s - 3 * STEP_S <= STEP_S * len(phase) <= most_s + 3 * STEP_S
        if phase[0][0] > 0.0:
            assert peaks_n[0] - 1e-3 <= max(force_n for force_n, _ in phase) <= peaks_n[1]
        else:
            # Not the force alone: the command ends, too, after the finger's return.
            assert phase[-1][1] == 0.0


def deflections(hands: Hands) -> list[Vector2]:
    """Return the calibrated deflections of the left and the right stick."""
    device, calibration = SimulatedDualSense(), TravelCalibration()
    device.set_sticks(hands.left_stick, hands.right_stick)
    state = device.read(0.0)
    assert state is not None
    sticks = (calibration.left_stick, state.left_stick), (calibration.right_stick, state.right_stick)
    return [rest.deflection(raw) for rest, raw in sticks]


@pytest.mark.parametrize(("kind", "own"), [("drift", 0), ("yaw", 1)])
def test_drift_and_yaw_deflect_one_stick_to_the_full_to_either_side(kind: PullKind, own: int) -> None:
    sides = set()
    for seed in range(8):
        pull = make_pull(kind, seed)
        found = deflections(pull(1.0))
        assert (abs(found[own][0]), found[own][1]) == pytest.approx((1.0, 0.0), abs=0.01)
        assert found[1 - own] == (0.0, 0.0)
        sides.add(round(found[own][0]))
        assert 0.25 <= settled_travel(pull(1.0).r2_n) <= 1.0
        assert pull(0.0) == pull(30.0)
    assert sides == {-1, 1}
