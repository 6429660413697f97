"""Pulls: the same ones for a seed, within what a finger does, and shaped as their names say."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.messages import Vector2
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind, force_for, make_pull
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import SimulatedTrigger
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from operator_side.simulated_person.pulling_hands import Hands, Pull, constant_force

REPEATABLE = settings(derandomize=True, deadline=None)
STEP_S = 0.001
FILLED_S = 19.0
"""A recorded approach is far shorter; pulls are made up for 20 s."""
SEEDS = range(8)
every_kind = pytest.mark.parametrize("kind", PULL_KINDS)


def samples(pull: Pull, end_s: float = FILLED_S, step_s: float = STEP_S) -> list[Hands]:
    return [pull(step_s * number) for number in range(round(end_s / step_s))]


def settled_travel(force_n: float) -> float:
    """The calibrated travel of a free trigger that has been pressed for long."""
    trigger = SimulatedTrigger()
    trigger.set_finger_force(force_n)
    trigger.advance(5.0)
    return TriggerTravel().travel(trigger.sensed_travel)


@given(st.floats(0.0, 1.0))
@REPEATABLE
def test_the_force_for_a_travel_holds_a_free_trigger_there(travel: float) -> None:
    assert settled_travel(force_for(travel)) == pytest.approx(travel, abs=1e-9)


def test_no_travel_takes_no_force() -> None:
    assert force_for(0.0) == 0.0
    # Hand-computed: the spring of 4 N over the travel of which 0.75 is sensed, 0.05 of that dead, 0.98 of it full.
    assert force_for(0.5) == pytest.approx(0.5 + 4.0 * 0.75 * (0.05 + 0.98) / 2.0)
    assert force_for(1.0) == pytest.approx(0.5 + 4.0 * 0.75 * 0.98)


@every_kind
def test_a_seed_gives_the_same_pull_in_any_order_and_another_one_another(kind: PullKind) -> None:
    first, pull = samples(make_pull(kind, 3), 5.0), make_pull(kind, 3)
    assert [pull(STEP_S * number) for number in reversed(range(len(first)))] == first[::-1]
    assert samples(make_pull(kind, 4), 5.0) != first


@every_kind
@pytest.mark.parametrize("seed", SEEDS)
def test_a_pull_presses_r2_alone_and_no_harder_than_a_finger(kind: PullKind, seed: int) -> None:
    hardest_n = 3.7 if kind == "on_off" else force_for(1.0)
    seen = samples(make_pull(kind, seed), 25.0, 0.01)
    assert all(0.0 <= hands.r2_n <= hardest_n for hands in seen)
    assert any(hands.r2_n > 0.5 for hands in seen)
    assert {hands.l2_n for hands in seen} == {0.0}
    if kind not in ("drift", "yaw"):
        assert {(hands.left_stick, hands.right_stick) for hands in seen} == {((0.0, 0.0), (0.0, 0.0))}


class Phase(NamedTuple):
    pressed: bool
    length_s: float
    peak_n: float


def phases(pull: Pull) -> Iterator[Phase]:
    """Whole phases of pressing and resting; the last one is cut off and left out."""
    runs = [list(run) for _, run in itertools.groupby(samples(pull), key=lambda hands: hands.r2_n > 0.0)]
    for run in runs[:-1]:
        yield Phase(run[0].r2_n > 0.0, STEP_S * len(run), max(hands.r2_n for hands in run))


@pytest.mark.parametrize("seed", SEEDS)
def test_bells_are_as_long_and_high_as_said_and_rest_between(seed: int) -> None:
    found = list(phases(make_pull("bell", seed)))
    bells, rests = [one for one in found if one.pressed], [one for one in found[1:] if not one.pressed]
    assert len(bells) >= 10
    # A bell's first and last millisecond press with nothing.
    assert all(0.7 - 3 * STEP_S <= one.length_s <= 1.4 for one in bells)
    assert all(0.1 <= one.length_s <= 0.4 + 3 * STEP_S for one in rests)
    assert all(force_for(0.5) - 1e-3 <= one.peak_n <= force_for(1.0) for one in bells)
    assert max(one.peak_n for one in bells) - min(one.peak_n for one in bells) > 0.2


def test_a_bell_rises_to_its_middle_and_falls_as_it_rose() -> None:
    pull = make_pull("bell", 1)
    forces = [hands.r2_n for hands in itertools.takewhile(lambda hands: hands.r2_n > 0.0, samples(pull)[1:])]
    middle = forces.index(max(forces))
    assert middle == pytest.approx(len(forces) / 2, abs=2)
    assert forces[:middle] == sorted(forces[:middle])
    assert forces[middle:] == sorted(forces[middle:], reverse=True)
    # Minimum jerk: at a quarter 16 (3/16)² of the peak's travel.
    quarter = forces[round(len(forces) / 4)]
    assert settled_travel(quarter) / settled_travel(max(forces)) == pytest.approx(16 * (3 / 16) ** 2, abs=0.01)


@pytest.mark.parametrize("seed", SEEDS)
def test_on_and_off_are_as_long_as_said(seed: int) -> None:
    found = list(phases(make_pull("on_off", seed)))
    assert len(found) >= 20
    assert found[0].pressed
    for one in found:
        least_s, most_s = (0.3, 0.7) if one.pressed else (0.2, 0.5)
        assert least_s - 2 * STEP_S <= one.length_s <= most_s + 2 * STEP_S
    [force_n] = {one.peak_n for one in found if one.pressed}
    assert 2.0 <= force_n <= 3.7


@pytest.mark.parametrize("kind", ["bell", "on_off"])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_trigger_comes_to_rest_in_each_rest(kind: PullKind, seed: int) -> None:
    """Not the force alone: the robot is told to stand, slow as the finger is."""
    pull, trigger = make_pull(kind, seed), SimulatedTrigger()
    told = []
    for hands in samples(pull):
        trigger.set_finger_force(hands.r2_n)
        trigger.advance(STEP_S)
        told.append((hands.r2_n > 0.0, TriggerTravel().travel(trigger.sensed_travel)))
    ends = [former for former, now in itertools.pairwise(told) if now[0] and not former[0]]
    assert len(ends) >= 10
    assert {travel for _, travel in ends} == {0.0}


def test_a_random_pull_wanders_over_the_whole_travel_without_jumping() -> None:
    travels = [
        settled_travel(hands.r2_n) for seed in SEEDS for hands in samples(make_pull("random", seed), FILLED_S, 0.02)
    ]
    assert min(travels) == 0.0
    assert max(travels) == pytest.approx(1.0)
    assert sum(travels) / len(travels) == pytest.approx(0.5, abs=0.1)
    for seed in SEEDS:
        path = [settled_travel(hands.r2_n) for hands in samples(make_pull("random", seed), FILLED_S, 0.005)]
        assert max(abs(later - one) for one, later in itertools.pairwise(path)) < 0.2
        # Correlated over 0.4 s: it is on the same side of its middle for a while.
        crossings = sum((later - 0.5) * (one - 0.5) < 0.0 for one, later in itertools.pairwise(path))
        assert 5 <= crossings <= 120


def deflections(hands: Hands) -> dict[str, Vector2]:
    """How far each stick counts as deflected."""
    device, calibration = SimulatedDualSense(), TravelCalibration()
    device.set_sticks(hands.left_stick, hands.right_stick)
    report = device.read(0.0)
    assert report is not None
    state = parse_input_report(report)
    return {
        "left_stick": calibration.left_stick.deflection(state.left_stick),
        "right_stick": calibration.right_stick.deflection(state.right_stick),
    }


@pytest.mark.parametrize("wanted", [(0.5, 0.0), (-0.6, 0.8), (0.0, -0.05)])
def test_sticks_count_as_far_as_said_for_a_second_and_a_half(wanted: Vector2) -> None:
    for name, pull in (
        ("left_stick", constant_force(2.5, wanted)),
        ("right_stick", constant_force(2.5, (0, 0), wanted)),
    ):
        for time_s in (0.0, 1.49):
            found = deflections(pull(time_s))
            assert found.pop(name) == pytest.approx(wanted, abs=0.01)
            assert list(found.values()) == [(0.0, 0.0)]
        assert pull(0.0).r2_n == 2.5
        assert pull(1.5) == pull(100.0) == Hands(r2_n=2.5)


@pytest.mark.parametrize(("kind", "which"), [("drift", "left_stick"), ("yaw", "right_stick")])
def test_drift_and_yaw_deflect_one_stick_to_the_full(kind: PullKind, which: str) -> None:
    sides = set()
    for seed in SEEDS:
        pull = make_pull(kind, seed)
        felt = deflections(pull(1.0))
        across, up = felt.pop(which)
        assert abs(across) == pytest.approx(1.0, abs=0.01)
        assert up == pytest.approx(0.0, abs=0.01)
        assert list(felt.values()) == [(0.0, 0.0)]
        sides.add(round(across))
        assert 0.25 <= settled_travel(pull(1.0).r2_n) <= 1.0
        assert len({pull(time_s) for time_s in (0.0, 0.5, 30.0)}) == 1
    assert sides == {-1, 1}
