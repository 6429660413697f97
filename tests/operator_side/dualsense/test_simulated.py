import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DeviceError
from operator_side.controller.feel import FREE_TRIGGER, USUAL_LIGHT, WARNING_LIGHT, Feel, Rumble
from operator_side.controller.state import Button, ControllerState
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import (
    SPRING_PRELOAD_N,
    SPRING_RISE_N,
    STRENGTH_STEP_N,
    SimulatedTrigger,
    equilibrium_travel,
)
from tests.helpers.messages import feedback

TRANSPORTS = pytest.mark.parametrize("transport", Transport)
STRENGTHS = st.tuples(*[st.integers(0, 8)] * 10)
STIFF = Feel(l2=feedback(3, 6), r2=feedback(0, 8))
NAN, INF = float("nan"), float("inf")


def resistance_n(travel: float, strength: int) -> float:
    return SPRING_PRELOAD_N + SPRING_RISE_N * travel + STRENGTH_STEP_N * strength


@given(st.floats(0.0, 10.0), STRENGTHS)
def test_forces_balance_at_the_equilibrium(force_n: float, strengths: tuple[int, ...]) -> None:
    """Below the equilibrium travel the finger overcomes the resistance; there, or one zone farther, it does not."""
    travel = equilibrium_travel(force_n, strengths)
    assert 0.0 <= travel <= 1.0
    for zone in range(10):
        begin, end = zone / 10, min((zone + 1) / 10, travel)
        if begin < travel:
            assert resistance_n(end, strengths[zone]) <= force_n + 1e-9
    if 0.0 < travel < 1.0:
        # At a boundary between zones, rounding decides which zone stops the finger.
        beside = {min(max(int(travel * 10 + one), 0), 9) for one in (-1e-9, 1e-9)}
        assert max(resistance_n(travel, strengths[zone]) for zone in beside) >= force_n - 1e-9


def report_at(device: SimulatedDualSense, now_s: float) -> bytes:
    report = device.read_report(now_s)
    assert report is not None
    return report


def state_at(device: SimulatedDualSense, now_s: float) -> ControllerState:
    state = device.read(now_s)
    assert state is not None
    return state


def number_of(report: bytes) -> int:
    return report[7]


def clock_of(report: bytes) -> float:
    """Return the sensor timestamp in a USB report, in seconds."""
    return int.from_bytes(report[28:32], "little") / 3e6


def test_a_report_every_4_ms() -> None:
    device = SimulatedDualSense()
    start_s = 1234.567
    reports = [device.read_report(start_s + tick * 0.001) for tick in range(1001)]
    assert [tick for tick, report in enumerate(reports) if report is not None] == list(range(0, 1001, 4))
    made = [report for report in reports if report is not None]
    assert [number_of(report) for report in made] == [number % 256 for number in range(251)]
    assert [clock_of(report) for report in made] == pytest.approx([n * 0.004 for n in range(251)], abs=1e-6)


def test_a_late_reader_gets_the_newest_report_once_and_clocks_wrap() -> None:
    device = SimulatedDualSense()
    assert state_at(device, 0.0) == ControllerState()
    assert number_of(report_at(device, 0.1015)) == 25
    assert device.read(0.1025) is None
    assert number_of(report_at(device, 0.104)) == 26
    report = report_at(device, 2000.0)
    assert number_of(report) == 500_000 % 256
    assert clock_of(report) == pytest.approx(2000.0 - 2**32 / 3e6, abs=1e-6)


@given(st.lists(st.tuples(st.floats(0.0, 8.0), STRENGTHS, st.integers(1, 60), st.booleans()), min_size=1, max_size=5))
@settings(max_examples=40)
def test_how_often_it_is_read_does_not_matter(phases: list[tuple[float, tuple[int, ...], int, bool]]) -> None:
    """Reading once for each phase or 20 times for each report gives the same travel and reports."""
    coarse, fine = SimulatedDualSense(), SimulatedDualSense()
    tick = 0
    for device in (coarse, fine):
        device.read(0.0)
    for force_n, strengths, ticks, writes in phases:
        for device in (coarse, fine):
            device.set_finger_force(force_n, force_n / 2)
            if writes:
                device.write(Feel(strengths, FREE_TRIGGER), tick * 0.0025)
        reports = [fine.read((tick + step / 12) * 0.0025) for step in range(1, ticks * 12)]
        tick += ticks
        reports.append(fine.read(tick * 0.0025))
        last = next((report for report in reversed(reports) if report is not None), None)
        assert coarse.read(tick * 0.0025) == last
        assert coarse.travel == pytest.approx(fine.travel, abs=1e-11)


@TRANSPORTS
def test_a_report_that_cannot_be_read_changes_nothing(transport: Transport) -> None:
    device = SimulatedDualSense(transport)
    device.write(STIFF, 0.0)
    good = build_output_report(Feel(FREE_TRIGGER, FREE_TRIGGER), transport)
    other = Transport.BLUETOOTH if transport is Transport.USB else Transport.USB
    debug = bytearray(good)
    debug[11 if transport is Transport.USB else 13] = 0xFC
    for report, message in (
        (b"", "no bytes"),
        (good[:-1], f"{len(good) - 1} bytes"),
        (bytes(debug), "0xfc" if transport is Transport.USB else "checksum"),
        (build_output_report(STIFF, other), f"of another transport; valid: a report for {transport.value}"),
    ):
        with pytest.raises(ValueError, match=message):
            device.apply_report(report, 0.1)
    assert device.strengths == (STIFF.l2, STIFF.r2)


def test_close_releases_puts_a_changed_light_back_and_ends() -> None:
    device = SimulatedDualSense()
    device.write(Feel(feedback(0, 8), feedback(0, 8), Rumble(1.0, 1.0), WARNING_LIGHT), 0.0)
    device.close()
    device.close()
    assert device.commanded == Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble(), USUAL_LIGHT)
    assert device.released
    with pytest.raises(DeviceError, match="closed"):
        device.read(0.1)
    with pytest.raises(DeviceError, match="closed"):
        device.write(Feel(), 0.1)


def used(what: str, *arguments: Any, **named: Any) -> Any:
    """Call a method of a controller that was read at 1 s, or of a simulated trigger."""
    device = SimulatedDualSense()
    device.read(1.0)
    owner: Any = SimulatedTrigger() if hasattr(SimulatedTrigger, what) and what != "set_finger_force" else device
    return getattr(owner, what)(*arguments, **named)


@pytest.mark.parametrize(
    ("what", "arguments", "message"),
    [
        *(("read", (now_s,), f"now_s = {now_s}; valid: ") for now_s in (0.9, NAN, INF)),
        *(("write", (Feel(), now_s), f"now_s = {now_s}; valid: ") for now_s in (0.9, NAN, INF)),
        *(("set_finger_force", (1.0, force_n), "finger_force_n = ") for force_n in (-1.0, NAN, INF)),
        *(("advance", (step_s,), "step_s = ") for step_s in (-0.1, NAN, INF)),
        ("set_sticks", ((1.5, 0.0),), "left_stick"),
        ("set_buttons", (frozenset({Button.L2}),), "pressed holds L2 or R2"),
        ("set_buttons", (frozenset({Button.UP, Button.DOWN}),), "down and up"),
        ("set_buttons", (frozenset({Button.LEFT_PADDLE}),), "only a DualSense Edge has these"),
    ],
)
def test_refusals(what: str, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        used(what, *arguments)


@pytest.mark.parametrize("finger_s", [0.01, 0.04, 0.2])
def test_a_finger_approaches_the_balance_of_forces_with_its_time_constant(finger_s: float) -> None:
    device = SimulatedDualSense(finger_s=finger_s)
    device.read(0.0)
    device.set_finger_force(0.0, SPRING_PRELOAD_N + 0.5 * SPRING_RISE_N)
    device.read(finger_s)
    assert device.travel == pytest.approx((0.0, 0.5 * (1.0 - math.exp(-1.0))), rel=1e-3)
