"""The motion sensors in SI units, by the controller's own calibration or the nominal one."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.reports.controller_state import AT_REST_M_S2, ControllerState
from operator_side.dualsense.reports.feature_report import CalibrationReport
from operator_side.dualsense.reports.input_report import build_input_report, parse_input_report
from operator_side.dualsense.reports.motion_sensors import NOMINAL_MOTION, MotionCalibration
from operator_side.dualsense.reports.transport import Transport

REPEATABLE = settings(derandomize=True, deadline=None)
G = 9.80665
TYPICAL = CalibrationReport(
    gyro_bias=(-4, 2, 7),
    gyro_plus=(8700, 8570, 8660),
    gyro_minus=(-8708, -8566, -8646),
    speed_plus=540,
    speed_minus=540,
    acceleration_plus=(8100, 8250, 8190),
    acceleration_minus=(-8200, -8150, -8230),
)
COUNTS = st.integers(-32768, 32767)
THREE = st.tuples(COUNTS, COUNTS, COUNTS)


def test_the_nominal_resolution() -> None:
    nominal = CalibrationReport((0, 0, 0), (8640,) * 3, (-8640,) * 3, 540, 540, (8192,) * 3, (-8192,) * 3)
    motion = MotionCalibration.of(nominal)
    assert motion.gyro_rad_s == pytest.approx(NOMINAL_MOTION.gyro_rad_s, rel=1e-15)
    assert motion.acceleration_m_s2 == NOMINAL_MOTION.acceleration_m_s2
    assert motion.nominal_axes == ()


@pytest.mark.parametrize("transport", Transport)
@pytest.mark.parametrize("axis", range(3))
def test_what_the_factory_measured_reads_as_what_it_did(transport: Transport, axis: int) -> None:
    """From plus to minus it is the two speeds, and two gravities, on every axis."""
    motion = MotionCalibration.parse(TYPICAL.build(transport), transport)
    assert motion.nominal_axes == ()
    span = TYPICAL.gyro_plus[axis] - TYPICAL.gyro_minus[axis]
    assert span * motion.gyro_rad_s[axis] == pytest.approx(math.radians(1080.0), rel=1e-12)
    for counts, expected in ((TYPICAL.acceleration_plus, G), (TYPICAL.acceleration_minus, -G)):
        read = (counts[axis] - motion.acceleration_zero[axis]) * motion.acceleration_m_s2[axis]
        assert read == pytest.approx(expected, rel=1e-12)


def test_a_report_is_read_by_the_controllers_calibration() -> None:
    motion = MotionCalibration.of(TYPICAL)
    turning = (1.0, -2.0, 3.0)
    state = ControllerState(gyro_rad_s=turning, acceleration_m_s2=AT_REST_M_S2)
    read = parse_input_report(build_input_report(state, Transport.USB, motion), motion)
    assert read.gyro_rad_s == pytest.approx(turning, abs=math.radians(1 / 32) * 1.02)
    assert read.acceleration_m_s2 == pytest.approx(AT_REST_M_S2, abs=G / 8000)
    by_the_nominal_one = parse_input_report(build_input_report(state, Transport.USB, motion))
    assert by_the_nominal_one.acceleration_m_s2 != pytest.approx(AT_REST_M_S2, abs=G / 8000)


def test_the_gyro_bias_is_not_taken_off() -> None:
    """As in Linux hid-playstation: the sensor takes it off itself."""
    shifted = replace(TYPICAL, gyro_bias=(100, 100, 100))
    assert MotionCalibration.of(shifted).gyro_rad_s == MotionCalibration.of(TYPICAL).gyro_rad_s


def test_a_clones_zeros_fall_back_to_the_nominal_scale_and_say_so() -> None:
    motion = MotionCalibration.parse(b"\x05" + bytes(40))
    assert motion.gyro_rad_s == NOMINAL_MOTION.gyro_rad_s
    assert motion.acceleration_m_s2 == NOMINAL_MOTION.acceleration_m_s2
    assert motion.acceleration_zero == (0.0, 0.0, 0.0)
    assert motion.nominal_axes == (
        *("gyro x", "gyro y", "gyro z"),
        *("acceleration x", "acceleration y", "acceleration z"),
    )


def test_one_absurd_axis_falls_back_alone() -> None:
    absurd = replace(TYPICAL, gyro_plus=(8700, 10, 8660), gyro_minus=(-8708, -10, -8646))
    motion = MotionCalibration.of(absurd)
    assert motion.nominal_axes == ("gyro y",)
    assert motion.gyro_rad_s[1] == NOMINAL_MOTION.gyro_rad_s[1]
    assert motion.gyro_rad_s[0] == MotionCalibration.of(TYPICAL).gyro_rad_s[0]
    upside_down = replace(TYPICAL, acceleration_plus=(-8100, 8250, 8190), acceleration_minus=(8200, -8150, -8230))
    assert MotionCalibration.of(upside_down).nominal_axes == ("acceleration x",)


@given(st.builds(CalibrationReport, THREE, THREE, THREE, COUNTS, COUNTS, THREE, THREE), THREE, THREE)
@REPEATABLE
def test_any_calibration_gives_finite_plausible_readings(
    measured: CalibrationReport, gyro: tuple[int, int, int], acceleration: tuple[int, int, int]
) -> None:
    motion = MotionCalibration.of(measured)
    for axis in range(3):
        assert 0.5 <= motion.gyro_rad_s[axis] / NOMINAL_MOTION.gyro_rad_s[axis] <= 2.0
        assert 0.5 <= motion.acceleration_m_s2[axis] / NOMINAL_MOTION.acceleration_m_s2[axis] <= 2.0
    turning = tuple(count * scale for count, scale in zip(gyro, motion.gyro_rad_s, strict=True))
    assert motion.gyro_counts((turning[0], turning[1], turning[2])) == gyro
    pushed = [
        (count - zero) * scale
        for count, zero, scale in zip(acceleration, motion.acceleration_zero, motion.acceleration_m_s2, strict=True)
    ]
    assert motion.acceleration_counts((pushed[0], pushed[1], pushed[2])) == acceleration


def test_beyond_the_range_is_its_end() -> None:
    assert NOMINAL_MOTION.gyro_counts((1e9, -1e9, 0.0)) == (32767, -32768, 0)


def test_a_tiny_scale_reaches_the_end_of_the_range() -> None:
    tiny = MotionCalibration((5e-324,) * 3, (5e-324,) * 3)
    assert tiny.gyro_counts((1e308, -1e308, 0.0)) == (32767, -32768, 0)
    assert tiny.acceleration_counts((1e308, -1e308, 0.0)) == (32767, -32768, 0)


def test_arguments_out_of_range() -> None:
    with pytest.raises(ValueError, match="gyro_rad_s = "):
        MotionCalibration(gyro_rad_s=(0.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="acceleration_m_s2 = "):
        MotionCalibration(acceleration_m_s2=(1.0, float("nan"), 1.0))
    with pytest.raises(ValueError, match="acceleration_m_s2 = "):
        MotionCalibration(acceleration_m_s2=(1.0, 1e308, 1.0))  # its readings would be infinite
    with pytest.raises(ValueError, match="acceleration_zero = "):
        MotionCalibration(acceleration_zero=(float("nan"), 0.0, 0.0))
