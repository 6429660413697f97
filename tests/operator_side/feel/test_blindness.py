"""Sight by examples; tests/operator_side/test_core_states.py holds every order of events."""

import itertools

import pytest

from operator_side.dualsense.reports.output_report import USUAL_LIGHT, WARNING_LIGHT, Rumble
from operator_side.feel.blindness import Blindness, Sight


def blind(since_s: float = 10.0) -> Blindness:
    blindness = Blindness()
    blindness.lose(since_s)
    return blindness


def test_who_never_saw_is_not_blind() -> None:
    blindness = Blindness()
    blindness.end()
    for released in (True, False):
        blindness.see_hands(released=released)
    assert (blindness.sight, blindness.holds, blindness.light, blindness.times) == (Sight.SEEING, False, None, 0)
    assert blindness.rumble(0.0) == Rumble()


def test_each_state_says_what_it_holds_and_shows() -> None:
    blindness = blind()
    assert (blindness.sight, blindness.holds, blindness.light) == (Sight.BLIND, True, WARNING_LIGHT)
    blindness.end()
    assert (blindness.sight, blindness.holds, blindness.light) == (Sight.WAITING, True, USUAL_LIGHT)
    assert blindness.rumble(10.0) == Rumble()
    blindness.see_hands(released=True)
    assert (blindness.sight, blindness.holds, blindness.light) == (Sight.SEEING, False, USUAL_LIGHT)


def test_lost_again_before_the_hands_rested_is_another_loss_and_still_lost_is_none() -> None:
    blindness = blind()
    blindness.end()
    blindness.lose(20.0)
    blindness.lose(23.0)
    assert (blindness.sight, blindness.light, blindness.times) == (Sight.BLIND, WARNING_LIGHT, 2)
    assert blindness.rumble(20.0) != Rumble() == blindness.rumble(23.0)


@pytest.mark.parametrize("since_s", [0.0, 10.0, 1e6])
def test_two_short_pulses_each_second_for_three_seconds(since_s: float) -> None:
    blindness = blind(since_s)
    shaken = [blindness.rumble(since_s + 0.01 * step + 0.001) for step in range(1000)]
    runs = [(drive, len(list(steps))) for drive, steps in itertools.groupby(shaken)]
    pulses = [length for drive, length in runs if drive != Rumble()]
    assert len(pulses) == 6
    assert set(pulses) == {12}
    assert all(drive.left == drive.right > 0.5 for drive in shaken if drive != Rumble())
    assert blindness.light == WARNING_LIGHT
    assert not any(drive.left for drive in shaken[300:])
