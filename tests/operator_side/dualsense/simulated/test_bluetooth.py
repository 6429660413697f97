"""The simulated controller on either transport: modes, checksums, features, the cable, and what its sensors say."""

import pytest

from common.errors import DeviceError
from operator_side.dualsense.effects.official import Feedback, Off, Weapon
from operator_side.dualsense.effects.unofficial_effects import Bow
from operator_side.dualsense.reports.attachments import ON_BLUETOOTH, Battery, BatteryState, TouchPoint
from operator_side.dualsense.reports.controller_state import AT_REST_M_S2, Button, ControllerState
from operator_side.dualsense.reports.feature_report import CalibrationReport, Firmware, parse_address
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.motion_sensors import MotionCalibration
from operator_side.dualsense.reports.output_report import MuteLed, OutputReport, Rumble, build_output_report
from operator_side.dualsense.reports.transport import Transport, is_simple_report, transport_of_input
from operator_side.dualsense.simulated.controller import SIMULATED_ADDRESS, SIMULATED_FIRMWARE, SimulatedDualSense

TRANSPORTS = pytest.mark.parametrize("transport", Transport)
STIFF = OutputReport(l2=Feedback(3, 6), r2=Weapon(2, 5, 8))
CROOKED = CalibrationReport(
    gyro_bias=(-4, 2, 7),
    gyro_plus=(8700, 8570, 8660),
    gyro_minus=(-8708, -8566, -8646),
    speed_plus=540,
    speed_minus=540,
    acceleration_plus=(8100, 8250, 8190),
    acceleration_minus=(-8200, -8150, -8230),
)


def report_at(device: SimulatedDualSense, now_s: float) -> bytes:
    report = device.read(now_s)
    assert report is not None
    return report


def full_mode(transport: Transport) -> SimulatedDualSense:
    device = SimulatedDualSense(transport)
    device.get_feature(0x09)
    return device


def test_bluetooth_starts_in_the_simple_mode() -> None:
    device = SimulatedDualSense(Transport.BLUETOOTH)
    device.set_buttons(frozenset({Button.CROSS}))
    for number in range(3):
        report = report_at(device, number * 0.004)
        assert is_simple_report(report)
        state = parse_input_report(report)
        assert state.sequence == number
        assert state.pressed == {Button.CROSS}
        assert state.gyro_rad_s is None
    device.get_feature(0x05)
    assert is_simple_report(report_at(device, 0.1))
    assert device.simple_mode


@pytest.mark.parametrize("report_id", [0x09, 0x20])
def test_reading_a_feature_ends_the_simple_mode(report_id: int) -> None:
    device = SimulatedDualSense(Transport.BLUETOOTH)
    device.read(0.0)
    device.get_feature(report_id)
    report = report_at(device, 0.004)
    assert len(report) == 78
    assert transport_of_input(report) is Transport.BLUETOOTH
    state = parse_input_report(report)
    assert state.sequence == 1
    assert state.connections == ON_BLUETOOTH
    assert state.battery == Battery(0.95, BatteryState.DISCHARGING)
    assert state.acceleration_m_s2 == AT_REST_M_S2


def test_writing_ends_the_simple_mode() -> None:
    device = SimulatedDualSense(Transport.BLUETOOTH)
    device.write(build_output_report(OutputReport(), Transport.BLUETOOTH), 0.0)
    assert len(report_at(device, 0.004)) == 78


def test_usb_has_no_simple_mode() -> None:
    assert len(report_at(SimulatedDualSense(), 0.0)) == 64


@TRANSPORTS
def test_what_is_written_is_in_force(transport: Transport) -> None:
    device = SimulatedDualSense(transport)
    device.write(build_output_report(STIFF, transport), 0.0)
    assert device.effects == (STIFF.l2, STIFF.r2)
    device.write(build_output_report(OutputReport(lightbar=(1, 2, 3), player_leds=4), transport, 1), 0.1)
    device.write(build_output_report(OutputReport(mute_led=MuteLed.ON), transport, 2), 0.2)
    assert device.output == OutputReport(
        STIFF.l2, STIFF.r2, Rumble(), lightbar=(1, 2, 3), player_leds=4, mute_led=MuteLed.ON
    )
    assert device.write_count == 3


def test_hardware_knows_the_unofficial_effects() -> None:
    device = SimulatedDualSense()
    device.write(build_output_report(OutputReport(l2=Bow(1, 4, 2, 8)), unofficial=True), 0.0)
    assert device.effects == (Bow(1, 4, 2, 8), Off())


def test_a_wrong_checksum_is_counted_and_ignored() -> None:
    device = SimulatedDualSense(Transport.BLUETOOTH)
    for bit in range(8, 78 * 8):
        report = bytearray(build_output_report(STIFF, Transport.BLUETOOTH))
        report[bit // 8] ^= 1 << bit % 8
        device.write(bytes(report), bit * 0.001)
    assert device.bad_checksums == 77 * 8
    assert device.write_count == 0
    assert device.released
    assert device.simple_mode


@TRANSPORTS
def test_the_other_transports_report_is_refused(transport: Transport) -> None:
    other = Transport.BLUETOOTH if transport is Transport.USB else Transport.USB
    device = SimulatedDualSense(transport)
    with pytest.raises(ValueError, match=f"not for a controller on {transport.value}"):
        device.write(build_output_report(STIFF, other), 0.0)
    assert device.released


@TRANSPORTS
def test_features(transport: Transport) -> None:
    device = SimulatedDualSense(transport, calibration=CROOKED)
    assert parse_address(device.get_feature(0x09), transport) == SIMULATED_ADDRESS == device.address
    assert Firmware.parse(device.get_feature(0x20), transport) == SIMULATED_FIRMWARE
    assert CalibrationReport.parse(device.get_feature(0x05), transport) == CROOKED
    with pytest.raises(DeviceError, match="no feature report 0x22; valid: 0x05, 0x09, 0x20"):
        device.get_feature(0x22)


@TRANSPORTS
def test_the_motion_sensors_need_the_controllers_calibration(transport: Transport) -> None:
    device = SimulatedDualSense(transport, calibration=CROOKED)
    motion = MotionCalibration.parse(device.get_feature(0x05), transport)
    device.get_feature(0x09)
    at_rest = parse_input_report(report_at(device, 0.0), motion)
    assert at_rest.acceleration_m_s2 == pytest.approx(AT_REST_M_S2, abs=0.5 * 9.81 / 8000)
    assert at_rest.gyro_rad_s == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    device.set_motion((1.0, -2.0, 3.0), (0.0, 0.0, -9.80665))
    moving = parse_input_report(report_at(device, 0.1), motion)
    assert moving.gyro_rad_s == pytest.approx((1.0, -2.0, 3.0), abs=0.6e-3)
    assert moving.acceleration_m_s2 == pytest.approx((0.0, 0.0, -9.80665), abs=0.5 * 9.81 / 8000)
    uncalibrated = parse_input_report(report_at(device, 0.2))
    assert uncalibrated.acceleration_m_s2 != pytest.approx((0.0, 0.0, -9.80665), abs=0.5 * 9.81 / 8000)


@TRANSPORTS
def test_touch_and_battery(transport: Transport) -> None:
    device = full_mode(transport)
    fingers = (TouchPoint(3, 0, 1079), TouchPoint(4, 1919, 0))
    device.set_touches(*fingers)
    device.set_battery(Battery(0.35, BatteryState.CHARGING))
    state = parse_input_report(report_at(device, 0.0))
    assert state.touches == fingers
    assert state.battery == Battery(0.35, BatteryState.CHARGING)
    device.set_touches()
    assert parse_input_report(report_at(device, 0.1)).touches == ()


@pytest.mark.parametrize("period_s", [0.001, 0.004])
def test_bluetooths_rate(period_s: float) -> None:
    device = SimulatedDualSense(Transport.BLUETOOTH, bluetooth_period_s=period_s)
    device.get_feature(0x20)
    reports = [device.read(tick * 0.0005) for tick in range(2001)]
    states = [parse_input_report(report) for report in reports if report is not None]
    assert len(states) == round(1.0 / period_s) + 1
    clocks = [state.sensor_time_s for state in states]
    assert clocks == pytest.approx([number * period_s for number in range(len(states))], abs=1e-6)


@TRANSPORTS
def test_unplugged_it_is_gone_and_plugged_in_it_starts_anew(transport: Transport) -> None:
    device = full_mode(transport)
    device.set_finger_force(0.0, 3.7)
    device.write(build_output_report(STIFF, transport), 0.0)
    device.read(1.0)
    device.unplug()
    assert device.released
    with pytest.raises(DeviceError, match=r"gone \(unplugged\)"):
        device.read(1.1)
    with pytest.raises(DeviceError, match=r"gone \(unplugged\)"):
        device.write(build_output_report(STIFF, transport), 1.1)
    with pytest.raises(DeviceError, match=r"gone \(unplugged\)"):
        device.get_feature(0x09)
    device.plug_in()
    device.get_feature(0x09)
    state = parse_input_report(report_at(device, 5.0))
    assert state.sensor_time_s == 0.0
    assert device.released
    assert parse_input_report(report_at(device, 6.0)).r2 == 1.0  # the finger is still there


def test_bluetooth_is_in_the_simple_mode_again_after_a_reconnect() -> None:
    device = full_mode(Transport.BLUETOOTH)
    assert not is_simple_report(report_at(device, 0.0))
    device.unplug()
    device.plug_in()
    assert is_simple_report(report_at(device, 0.1))


def test_what_was_closed_can_be_plugged_in_again() -> None:
    device = SimulatedDualSense()
    device.unplug()
    device.close()
    device.plug_in()
    assert parse_input_report(report_at(device, 0.0)) == ControllerState()


def test_only_the_edge_has_paddles() -> None:
    paddles = frozenset({Button.LEFT_PADDLE, Button.RIGHT_FUNCTION})
    edge = SimulatedDualSense(model=Model.EDGE)
    edge.set_buttons(paddles)
    assert parse_input_report(report_at(edge, 0.0)).pressed == paddles
    assert edge.model.value == 0x0DF2
    with pytest.raises(ValueError, match="valid: only on a DualSense Edge"):
        SimulatedDualSense().set_buttons(paddles)


def test_power_reduction_weakens_the_triggers() -> None:
    travels = []
    for reduction in range(8):
        device = SimulatedDualSense()
        device.set_finger_force(0.0, 3.7)
        device.write(build_output_report(OutputReport(r2=Feedback(0, 8), trigger_power_reduction=reduction)), 0.0)
        travels.append(parse_input_report(report_at(device, 2.0)).r2)
    assert travels == sorted(travels)
    assert len(set(travels)) == 8
    half = SimulatedDualSense()
    half.set_finger_force(0.0, 3.7)
    half.write(build_output_report(OutputReport(r2=Feedback(0, 4))), 0.0)
    assert travels[4] == parse_input_report(report_at(half, 2.0)).r2  # steps of 12.5 %


def test_arguments_out_of_range() -> None:
    for period_s in (0.0, -0.001, float("nan")):
        with pytest.raises(ValueError, match="bluetooth_period_s"):
            SimulatedDualSense(Transport.BLUETOOTH, bluetooth_period_s=period_s)
    with pytest.raises(ValueError, match="address"):
        SimulatedDualSense(address="nobody")
    device = SimulatedDualSense()
    with pytest.raises(ValueError, match="touches has 3"):
        device.set_touches(*(TouchPoint(number, 0, 0) for number in range(3)))
    with pytest.raises(ValueError, match="gyro_rad_s"):
        device.set_motion(gyro_rad_s=(float("inf"), 0.0, 0.0))
