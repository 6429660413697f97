"""Stops later than the limits say, with arms of few lines in virtual time: by how much, and never without cause."""

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.late_stops import LateStops
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import ArmState

TICK_S = 0.004
SAID = ArmLimits(velocity_rad_s=1.0, acceleration_rad_s2=8.0)
NAMES = ("joint 1", "joint 2", "joint 3")


def stops(
    real_rad_s2: float,
    delay_s: float = 0.0,
    said: ArmLimits = SAID,
    speed: float = 0.8,
    late_s: float = 0.0,
    weakens_s: float = 0.0,
) -> LateStops:
    """Drive three joints to and fro, four times, each time to a stop."""
    judge, random = LateStops(said.of_joints(3), NAMES, 2e-4), np.random.default_rng(2)
    position, velocity, told = np.zeros(3), np.zeros(3), list[FloatArray]()
    seen = list[tuple[float, FloatArray, FloatArray]]()
    for tick in range(2500):
        now_s = tick * TICK_S
        turn = 1.0 if tick // 625 % 2 == 0 else -1.0
        share = 1.0 if tick % 625 < 300 else 0.0
        if weakens_s:
            share = 1.0 - 0.8 * min(max(tick % 625 - 300, 0) * TICK_S / weakens_s, 1.0)
        told.append(turn * speed * share * np.array([1.0, 0.5, 0.0]))
        asked = told[max(tick - round((delay_s + late_s) / TICK_S), 0)]
        change = asked - velocity
        most = real_rad_s2 * TICK_S
        velocity = velocity + change * min(1.0, most / max(float(np.abs(change).max()), 1e-12))
        position = position + TICK_S * velocity
        seen.append((now_s, position + random.normal(0.0, 2e-4, 3), velocity))
        time_s, read, rate = seen[max(tick - round(late_s / TICK_S), 0)]
        judge.update(told[tick], ArmState(time_s, read, rate, np.empty(0), 0.0, gripper_holding=False), late_s)
    return judge


@pytest.mark.parametrize("late_s", [0.0, 0.02])
@pytest.mark.parametrize("said", [SAID, ArmLimits(1.0, 2.0), ArmLimits(1.0, 8.0, latency_s=0.1)])
def test_an_arm_as_said_is_never_late(said: ArmLimits, late_s: float) -> None:
    judge = stops(float(said.of_joints(1).acceleration_rad_s2[0]), said.latency_s or 0.0, said, late_s=late_s)
    assert judge.summary() == {"judged": 4, "later_ms": 0.0}
    assert judge.take_notes() == []


def test_a_slow_arm_is_late_by_its_longer_braking() -> None:
    judge = stops(2.0)
    # From 0.8 rad/s, v / 2a: 0.2 s instead of 0.05.
    assert judge.later_s == pytest.approx(0.15, rel=0.1)
    [note, *_] = judge.take_notes()
    assert note.startswith("joint ")
    assert "later than [arm.limits] say" in note
    assert judge.take_notes() == []


@pytest.mark.parametrize("delay_s", [0.06, 0.2])
def test_a_late_drive_is_late_by_its_latency(delay_s: float) -> None:
    assert stops(8.0, delay_s).later_s == pytest.approx(delay_s, abs=0.012)


@pytest.mark.parametrize("delay_s", [0.0, 0.15])
def test_a_pull_that_only_weakens_shows_it_too(delay_s: float) -> None:
    """A finger that is slowed down by a stiff trigger hardly lets go: the command falls by four fifths within 0.3 s."""
    assert stops(8.0, delay_s, weakens_s=0.3).later_s == pytest.approx(delay_s, abs=0.012)


def test_readings_that_wrap_and_an_arm_that_is_put_back_say_nothing() -> None:
    judge = LateStops(SAID.of_joints(3), NAMES, 2e-4, np.array([2.0 * np.pi, np.inf, np.inf]))
    position, velocity = np.array([np.pi - 0.3, 0.0, 0.0]), np.zeros(3)
    for tick in range(600):
        told = np.full(3, 0.8) if tick < 200 else np.zeros(3)
        velocity = velocity + np.clip(told - velocity, -8.0 * TICK_S, 8.0 * TICK_S)
        position = position + TICK_S * velocity
        if tick == 205:
            position = position + np.array([0.0, 1.0, 1.0])
            judge.restart()
        read = np.array([(position[0] + np.pi) % (2.0 * np.pi) - np.pi, *position[1:]])
        judge.update(told, ArmState(tick * TICK_S, read, velocity, np.empty(0), 0.0, gripper_holding=False), 0.0)
    assert judge.later_s == 0.0


def test_slow_motion_says_nothing() -> None:
    assert stops(2.0, speed=0.05).summary() == {"judged": 0, "later_ms": 0.0}
