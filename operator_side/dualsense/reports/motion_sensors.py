"""The motion sensors' counts to rad/s and m/s², by the calibration that the controller itself holds.

The arithmetic is that of Linux hid-playstation: the gyroscope's bias enters its scale only and is not taken off
(so does Sony's driver; SDL takes it off), the accelerometer's zero lies midway between plus and minus one gravity.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

from common.checks import check_numbers
from operator_side.dualsense.reports.controller_state import STANDARD_GRAVITY_M_S2, Vector3
from operator_side.dualsense.reports.feature_report import CalibrationReport
from operator_side.dualsense.reports.transport import Transport

NOMINAL_GYRO_RAD_S: Final = math.radians(1.0 / 16.0)
"""One count turns by this: 2048 degrees a second over the whole range of 16 bits."""
NOMINAL_ACCELERATION_M_S2: Final = STANDARD_GRAVITY_M_S2 / 8192.0
"""One count: 4 g over the whole range."""
PLAUSIBLE_RATIO: Final = 2.0
"""A calibrated scale further from the nominal one than this, either way, is a broken or missing calibration."""

_LARGEST_SCALE: Final = 1e6
"""What is finite stays finite in every count; nothing turns or falls so fast."""
_COUNTS: Final = range(-(2**15), 2**15)


@dataclass(frozen=True, slots=True)
class MotionCalibration:
    """How to read one controller's motion sensors."""

    gyro_rad_s: Vector3 = (NOMINAL_GYRO_RAD_S,) * 3
    """Of one count, about x, y and z."""
    acceleration_m_s2: Vector3 = (NOMINAL_ACCELERATION_M_S2,) * 3
    """Of one count, along x, y and z."""
    acceleration_zero: Vector3 = (0.0, 0.0, 0.0)
    """The counts of no acceleration."""
    nominal_axes: tuple[str, ...] = ()
    """The axes whose calibration in the controller is unusable, so that the nominal one stands in for it."""

    def __post_init__(self) -> None:
        for name in ("gyro_rad_s", "acceleration_m_s2"):
            scales = getattr(self, name)
            check_numbers(name, scales, 3, 0.0, _LARGEST_SCALE)
            if 0.0 in scales:
                raise ValueError(f"{name} = {scales}; valid: above 0")
        check_numbers("acceleration_zero", self.acceleration_zero, 3, -(2.0**15), 2.0**15)

    @classmethod
    def parse(cls, report: bytes, transport: Transport = Transport.USB) -> Self:
        """Read feature report 0x05; RemoteProtocolError for another id, length or checksum.

        An axis without a plausible calibration (a clone's zeros) gets the nominal one and is in `nominal_axes`.
        """
        return cls.of(CalibrationReport.parse(report, transport))

    @classmethod
    def of(cls, measured: CalibrationReport) -> Self:
        """The scales that follow from what the factory measured."""
        nominal = []
        gyro, acceleration, zeros = [], [], []
        speeds_rad_s = math.radians(measured.speed_plus + measured.speed_minus)
        for axis in range(3):
            bias = measured.gyro_bias[axis]
            span = abs(measured.gyro_plus[axis] - bias) + abs(measured.gyro_minus[axis] - bias)
            scale = _plausible(speeds_rad_s, span, NOMINAL_GYRO_RAD_S)
            if scale is None:
                nominal.append(f"gyro {'xyz'[axis]}")
            gyro.append(scale or NOMINAL_GYRO_RAD_S)
        for axis in range(3):
            plus, minus = measured.acceleration_plus[axis], measured.acceleration_minus[axis]
            scale = _plausible(2.0 * STANDARD_GRAVITY_M_S2, plus - minus, NOMINAL_ACCELERATION_M_S2)
            if scale is None:
                nominal.append(f"acceleration {'xyz'[axis]}")
            acceleration.append(scale or NOMINAL_ACCELERATION_M_S2)
            zeros.append(0.0 if scale is None else (plus + minus) / 2.0)
        return cls(_three(gyro), _three(acceleration), _three(zeros), tuple(nominal))

    def gyro_counts(self, gyro_rad_s: Vector3) -> tuple[int, ...]:
        """What the gyroscope says of this turning, at the end of its range beyond it."""
        return tuple(_count(value / scale) for value, scale in zip(gyro_rad_s, self.gyro_rad_s, strict=True))

    def acceleration_counts(self, acceleration_m_s2: Vector3) -> tuple[int, ...]:
        """What the accelerometer says of this acceleration, at the end of its range beyond it."""
        per_axis = zip(acceleration_m_s2, self.acceleration_m_s2, self.acceleration_zero, strict=True)
        return tuple(_count(value / scale + zero) for value, scale, zero in per_axis)


NOMINAL_MOTION: Final = MotionCalibration()
"""What a controller without a calibration of its own is read by."""


def _plausible(value: float, counts: int, nominal: float) -> float | None:
    if counts <= 0 or not nominal / PLAUSIBLE_RATIO <= value / counts <= nominal * PLAUSIBLE_RATIO:
        return None
    return value / counts


def _three(values: list[float]) -> Vector3:
    x, y, z = values
    return x, y, z


def _count(exact: float) -> int:
    return round(max(_COUNTS[0], min(_COUNTS[-1], exact)))  # a tiny scale may make it infinite
