"""A finger that only pulls, at a desk in front of a screen: it rests, arms, and pulls on."""

from common.protocol.messages import Telemetry
from operator_side.dualsense.reports.controller_state import Button
from operator_side.simulated_person.person import SimulatedOperator
from operator_side.simulated_person.pulling_hands import PullingHands
from operator_side.simulated_person.settings import PersonSettings
from operator_side.simulated_person.whoever import whoever
from tests.helpers.simulated_desk import TICK_S, VIEW, WatchedDualSense, armed


def test_whoever_is_asked_for_has_the_controller() -> None:
    device = WatchedDualSense()
    assert isinstance(whoever(device, PersonSettings(), 0), SimulatedOperator)
    assert isinstance(whoever(device, PersonSettings(pull_n=0.0), 0), PullingHands)


def test_the_finger_rests_arms_and_pulls_with_its_constant_force() -> None:
    device = WatchedDualSense()
    hands = whoever(device, PersonSettings(pull_n=3.0), 0)
    seen: list[tuple[str, float, float, bool]] = []
    tick = 0

    def watch(screen: Telemetry, duration_s: float) -> None:
        nonlocal tick
        for _ in range(round(duration_s / TICK_S)):
            hands.tick(tick * TICK_S, screen, 0.0)
            seen.append((hands.doing, *device.forces_n, Button.OPTIONS in device.buttons))
            assert Button.L1 in device.buttons
            tick += 1

    watch(VIEW, 1.2)
    assert set(seen) == {("resting", 0.0, 0.0, False)}
    watch(VIEW, 0.1)
    assert seen[-1] == ("arming", 0.0, 0.0, True)
    watch(armed(), 60.0)
    assert set(seen[-10_000:]) == {("pulling", 0.0, 3.0, False)}
