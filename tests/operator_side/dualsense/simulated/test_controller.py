"""The simulated controller: bytes in, bytes out, 250 reports a second of the time it is given."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DeviceError
from operator_side.dualsense.effects.official import Feedback, MultiPositionFeedback, Off
from operator_side.dualsense.hid.port import Device
from operator_side.dualsense.reports.controller_state import Button, ControllerState, TriggerFeedback
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import (
    USUAL_LIGHT,
    WARNING_LIGHT,
    OutputReport,
    Rumble,
    build_output_report,
)
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N

STRENGTHS = st.lists(st.integers(0, 8), min_size=10, max_size=10)


def newest(device: Device, now_s: float) -> ControllerState:
    report = device.read(now_s)
    assert report is not None
    return parse_input_report(report)


def settled(device: SimulatedDualSense, start_s: float) -> ControllerState:
    """The state once the fingers have come to rest."""
    device.read(start_s)
    return newest(device, start_s + 1.0)


def test_an_untouched_controller() -> None:
    assert newest(SimulatedDualSense(), 12.5) == ControllerState()


def test_a_report_every_4_ms() -> None:
    device = SimulatedDualSense()
    start_s = 1234.567
    reports = [device.read(start_s + tick * 0.001) for tick in range(1001)]
    came = [tick for tick, report in enumerate(reports) if report is not None]
    assert came == list(range(0, 1001, 4))
    states = [parse_input_report(report) for report in reports if report is not None]
    assert [state.sequence for state in states] == [number % 256 for number in range(251)]
    assert [state.sensor_time_s for state in states] == pytest.approx([n * 0.004 for n in range(251)], abs=1e-9)


def test_a_late_reader_gets_the_newest_report_once() -> None:
    device = SimulatedDualSense()
    device.read(0.0)
    state = newest(device, 0.1015)
    assert state.sequence == 25
    assert device.read(0.1025) is None
    assert newest(device, 0.104).sequence == 26


def test_sequence_and_sensor_clock_wrap() -> None:
    device = SimulatedDualSense()
    device.read(0.0)
    state = newest(device, 2000.0)
    assert state.sequence == 500_000 % 256
    assert state.sensor_time_s == pytest.approx(2000.0 - 2**32 / 3e6, abs=1e-6)


def test_sticks_and_buttons_come_through() -> None:
    device = SimulatedDualSense()
    device.set_sticks(left=(1.0, -1.0), right=(-0.5, 0.5))
    device.set_buttons(frozenset({Button.L1, Button.CROSS, Button.UP}))
    state = newest(device, 0.0)
    assert state.left_stick == (1.0, -1.0)
    assert state.right_stick == (-0.5, 0.5)
    assert state.pressed == {Button.L1, Button.CROSS, Button.UP}


def test_a_pull_is_full_when_free_and_less_when_stiff() -> None:
    device = SimulatedDualSense()
    device.set_finger_force(NORMAL_FINGER_FORCE_N, NORMAL_FINGER_FORCE_N)
    free = settled(device, 0.0)
    assert (free.l2, free.r2) == (1.0, 1.0)
    assert free.pressed == {Button.L2, Button.R2}
    assert free.r2_feedback == TriggerFeedback()

    device.write(build_output_report(OutputReport(r2=Feedback(0, 8))), 1.0)
    stiff = settled(device, 1.0)
    assert stiff.l2 == 1.0
    assert 0.25 <= stiff.r2 <= 0.6
    assert stiff.r2_feedback == TriggerFeedback(stop_location=3, status=1, active_effect=1)
    assert stiff.l2_feedback == TriggerFeedback()

    device.set_finger_force(0.0, 0.0)
    let_go = settled(device, 2.0)
    assert (let_go.l2, let_go.r2) == (0.0, 0.0)
    assert let_go.pressed == frozenset()
    assert let_go.r2_feedback == TriggerFeedback(stop_location=0, status=0, active_effect=1)


@pytest.mark.parametrize(
    "effects",
    [
        [Off(), *(Feedback(0, strength) for strength in range(1, 9))],
        [Off(), *(Feedback(zone, 8) for zone in reversed(range(8)))],
    ],
    ids=["stronger", "sooner"],
)
def test_travel_falls_as_an_effect_gets_stronger_or_begins_sooner(effects: list[Feedback | Off]) -> None:
    travels = []
    for effect in effects:
        device = SimulatedDualSense()
        device.set_finger_force(0.0, NORMAL_FINGER_FORCE_N)
        device.write(build_output_report(OutputReport(r2=effect)), 0.0)
        travels.append(newest(device, 2.0).r2)
    assert travels == sorted(travels, reverse=True)
    assert travels[1] < travels[0] == 1.0
    assert len(set(travels)) > 5  # the strongest hold a normal finger in the fourth zone wherever they begin before


def test_output_reports_change_only_what_they_set() -> None:
    device = SimulatedDualSense()
    assert device.released
    device.write(build_output_report(OutputReport(l2=Feedback(3, 6), rumble=Rumble(1.0, 0.2))), 0.0)
    assert device.effects == (Feedback(3, 6), Off())
    assert device.rumble == Rumble(1.0, 0.2)
    assert not device.released
    device.write(build_output_report(OutputReport(r2=MultiPositionFeedback((0, 0, 3, 0, 0, 0, 0, 0, 0, 0)))), 0.001)
    assert device.effects == (Feedback(3, 6), MultiPositionFeedback((0, 0, 3, 0, 0, 0, 0, 0, 0, 0)))
    assert device.rumble == Rumble(1.0, 0.2)
    device.write(build_output_report(OutputReport(l2=Off(), r2=Feedback(2, 0))), 0.002)
    assert device.released
    assert device.write_count == 3


@pytest.mark.parametrize("report", [b"", b"\x31" + bytes(77), b"\x02" + bytes(46)])
def test_a_bad_output_report_changes_nothing(report: bytes) -> None:
    device = SimulatedDualSense()
    device.write(build_output_report(OutputReport(l2=Feedback(3, 6))), 0.0)
    with pytest.raises(ValueError, match="report"):
        device.write(report, 0.1)
    half_good = bytearray(build_output_report(OutputReport(Off(), Off())))
    half_good[11] = 0xFC
    with pytest.raises(ValueError, match="0xfc"):
        device.write(bytes(half_good), 0.1)
    assert device.effects == (Feedback(3, 6), Off())
    assert device.write_count == 1


@given(
    st.lists(
        st.tuples(st.floats(0.0, 8.0), STRENGTHS, st.integers(1, 60), st.booleans()),
        min_size=1,
        max_size=5,
    )
)
@settings(derandomize=True, deadline=None, max_examples=40)
def test_how_often_it_is_read_does_not_matter(phases: list[tuple[float, list[int], int, bool]]) -> None:
    """The same hands and writes, read once a phase or 20 times a report: the same travel and report."""
    coarse, fine = SimulatedDualSense(), SimulatedDualSense()
    tick = 0
    for device in (coarse, fine):
        device.read(0.0)
    for force_n, strengths, ticks, writes in phases:
        for device in (coarse, fine):
            device.set_finger_force(force_n, force_n / 2)
            if writes:
                effect = MultiPositionFeedback(tuple(strengths))
                device.write(build_output_report(OutputReport(effect, Off())), tick * 0.0025)
        reports = [fine.read((tick + step / 12) * 0.0025) for step in range(1, ticks * 12)]
        tick += ticks
        reports.append(fine.read(tick * 0.0025))
        last = next((report for report in reversed(reports) if report is not None), None)
        coarse_report = coarse.read(tick * 0.0025)
        assert (coarse_report is None) == (last is None)
        if coarse_report is not None and last is not None:
            assert parse_input_report(coarse_report) == parse_input_report(last)
        assert coarse.travel == pytest.approx(fine.travel, abs=1e-11)


def test_close_releases_and_ends() -> None:
    device = SimulatedDualSense()
    device.write(build_output_report(OutputReport(Feedback(0, 8), Feedback(0, 8), Rumble(1.0, 1.0))), 0.0)
    device.close()
    device.close()
    assert device.released
    assert device.rumble == Rumble()
    assert device.write_count == 1
    with pytest.raises(DeviceError, match="closed"):
        device.read(0.1)
    with pytest.raises(DeviceError, match="closed"):
        device.write(build_output_report(OutputReport()), 0.1)


def test_close_puts_back_a_light_that_was_changed() -> None:
    device = SimulatedDualSense()
    device.write(build_output_report(OutputReport(lightbar=WARNING_LIGHT)), 0.0)
    device.close()
    assert device.output.lightbar == USUAL_LIGHT


def test_arguments_out_of_range() -> None:
    device = SimulatedDualSense()
    device.read(1.0)
    for now_s in (0.9, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="now_s"):
            device.read(now_s)
        with pytest.raises(ValueError, match="now_s"):
            device.write(build_output_report(OutputReport()), now_s)
    with pytest.raises(ValueError, match="left_stick"):
        device.set_sticks(left=(1.5, 0.0))
    with pytest.raises(ValueError, match="L2"):
        device.set_buttons(frozenset({Button.L2}))
    with pytest.raises(ValueError, match="up and down"):
        device.set_buttons(frozenset({Button.UP, Button.DOWN}))
    with pytest.raises(ValueError, match="finger_force_n"):
        device.set_finger_force(1.0, -1.0)
