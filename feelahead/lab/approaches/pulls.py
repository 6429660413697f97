"""Motions of a hand on triggers and sticks over time, drawn from a seed; forces are in newtons.

A pull is open loop: it does not depend on what is felt or on the objects ahead.
"""

import math
from bisect import bisect_right
from dataclasses import replace
from typing import Final, Literal, get_args

import numpy as np

from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.dualsense.simulated.trigger_model import SPRING_PRELOAD_N, SPRING_RISE_N
from operator_side.hands.travel_calibration import StickRest, TriggerTravel
from operator_side.people.port import FingerInput, Pull

PullKind = Literal["steady", "bell", "on_off", "random", "drift", "yaw", "swerve"]
PULL_KINDS: Final[tuple[PullKind, ...]] = get_args(PullKind)

_TRAVEL = TriggerTravel()
_STICK = StickRest()
_NOISE_STEP_S = 0.05
_LONGEST_S = 20.0


def force_for(travel: float) -> float:
    """Return the force in newtons that holds a free trigger at the calibrated `travel`, 0 to 1."""
    return SPRING_PRELOAD_N + SPRING_RISE_N * SENSED_TRAVEL * _TRAVEL.raw(travel) if travel > 0.0 else 0.0


def make_pull(kind: PullKind, seed: int) -> Pull:
    """Draw a pull of this kind from `seed`.

    steady: one travel between 0.25 and 1. bell: bell-shaped pulls of 0.7 to 1.4 s (minimum jerk), with rests between.
    on_off: pressed for 0.3 to 0.7 s, released for 0.2 to 0.5 s. random: travel that wanders between 0 and 1.
    drift, yaw: steady, while a stick moves across at 0.1 m/s, or turns at 0.5 rad/s, to one side. swerve: steady, while
    one stick, 0.4 to 0.8 deflected, changes sides every 0.3 to 0.7 s.
    """
    generator = np.random.default_rng([seed, PULL_KINDS.index(kind)])
    if kind == "bell":
        return _bells(generator)
    if kind == "on_off":
        return _on_off(generator)
    if kind == "random":
        return _wandering(generator)
    if kind == "swerve":
        return _swerving(generator)
    side = float(generator.choice([-1.0, 1.0]))
    stick = (side * (_STICK.dead_zone + 1.0 - _STICK.dead_zone), 0.0)
    hands = FingerInput(
        r2_n=force_for(float(generator.uniform(0.25, 1.0))),
        left_stick=stick if kind == "drift" else (0.0, 0.0),
        right_stick=stick if kind == "yaw" else (0.0, 0.0),
    )
    return lambda _: hands


def no_stronger(pull: Pull, most_n: float) -> Pull:
    """Return the pull with R2's force limited to `most_n`."""

    def weaker(since_s: float) -> FingerInput:
        hands = pull(since_s)
        return replace(hands, r2_n=min(hands.r2_n, most_n))

    return weaker


def _bells(generator: np.random.Generator) -> Pull:
    """Draw pulls with the speed of an aiming hand: v(t) = peak · 16 x² (1 - x)², x from 0 to 1 (Flash, Hogan 1985)."""
    bells, end_s = [], 0.0
    while end_s < _LONGEST_S:
        duration_s = float(generator.uniform(0.7, 1.4))
        bells.append((end_s, duration_s, float(generator.uniform(0.5, 1.0))))
        end_s += duration_s + float(generator.uniform(0.1, 0.4))

    def pull(since_s: float) -> FingerInput:
        for start_s, duration_s, peak in bells:
            if start_s <= since_s < start_s + duration_s:
                x = (since_s - start_s) / duration_s
                return FingerInput(r2_n=force_for(peak * 16.0 * x * x * (1.0 - x) ** 2))
        return FingerInput()

    return pull


def _on_off(generator: np.random.Generator) -> Pull:
    force_n = float(generator.uniform(2.0, 3.7))
    presses, end_s = [], 0.0
    while end_s < _LONGEST_S:
        pressed_s = float(generator.uniform(0.3, 0.7))
        presses.append((end_s, end_s + pressed_s))
        end_s += pressed_s + float(generator.uniform(0.2, 0.5))
    pressed = FingerInput(r2_n=force_n)
    return lambda since_s: pressed if any(start <= since_s < end for start, end in presses) else FingerInput()


def _swerving(generator: np.random.Generator) -> Pull:
    force_n, turns = force_for(float(generator.uniform(0.25, 1.0))), bool(generator.integers(2))
    deflected = float(generator.uniform(0.4, 0.8)) * float(generator.choice([-1.0, 1.0]))
    ends_s = np.cumsum(generator.uniform(0.3, 0.7, size=round(_LONGEST_S / 0.3))).tolist()

    def pull(since_s: float) -> FingerInput:
        stick = (deflected * (-1.0) ** bisect_right(ends_s, since_s), 0.0)
        return FingerInput(
            r2_n=force_n, left_stick=(0.0, 0.0) if turns else stick, right_stick=stick if turns else (0.0, 0.0)
        )

    return pull


def _wandering(generator: np.random.Generator) -> Pull:
    """Draw a random travel with mean 0.5 and standard deviation 0.35, correlated over 0.4 s and cut to 0 to 1."""
    keep = math.exp(-_NOISE_STEP_S / 0.4)
    value, travels = float(generator.standard_normal()), []
    for _ in range(round(_LONGEST_S / _NOISE_STEP_S) + 2):
        travels.append(min(max(0.5 + 0.35 * value, 0.0), 1.0))
        value = keep * value + math.sqrt(1.0 - keep * keep) * float(generator.standard_normal())

    def pull(since_s: float) -> FingerInput:
        place = min(max(since_s, 0.0) / _NOISE_STEP_S, len(travels) - 2.0)
        index = int(place)
        part = place - index
        return FingerInput(r2_n=force_for((1.0 - part) * travels[index] + part * travels[index + 1]))

    return pull
