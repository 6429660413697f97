"""Rumble and light that signal blindness; test_core_states.py tests the states in any order of events."""

import itertools

import pytest

from operator_side.controller.feel import WARNING_LIGHT, Rumble
from operator_side.feel.blindness import Blindness


@pytest.mark.parametrize("since_s", [0.0, 10.0, 1e6])
def test_two_short_pulses_each_second_for_three_seconds(since_s: float) -> None:
    blindness = Blindness()
    blindness.lose(since_s)
    blindness.lose(since_s + 1.0)  # Still lost: not another loss.
    shaken = [blindness.rumble(since_s + 0.01 * step + 0.001) for step in range(1000)]
    runs = [(drive, len(list(steps))) for drive, steps in itertools.groupby(shaken)]
    assert [length for drive, length in runs if drive != Rumble()] == [12] * 6
    assert all(drive.left == drive.right > 0.5 for drive in shaken if drive != Rumble())
    assert (blindness.light, blindness.times) == (WARNING_LIGHT, 1)
    assert not any(drive.left for drive in shaken[300:])
