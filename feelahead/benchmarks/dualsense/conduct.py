"""What a DualSense driver is held to: the reports that it is given, and the findings that can be compared."""

import timeit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from operator_side.dualsense.reports.attachments import TouchPoint
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.dualsense.reports.transport import Transport

REPORT_PERIOD_S: Final = 0.004
"""About 250 reports a second on USB (SDL)."""
TOUCH: Final = TouchPoint(identity=5, x=960, y=540)
PULLED: Final = ControllerState(
    r2=0.6, gyro_rad_s=(0.5, -1.0, 2.0), acceleration_m_s2=(3.0, 9.0, -2.0), touches=(TOUCH,)
)
"""What the controller is made to say: every axis its own value."""
GYRO_COUNTS: Final = (458, -917, 1833)
ACCELERATION_COUNTS: Final = (2506, 7518, -1671)
"""The same in counts of the nominal calibration, from 16 a degree per second and 8192 a g."""
_OUR_FLAGS: Final = (0x0F, 0x00)
"""Rumble, and an effect for either trigger; everything else belongs to the system's driver."""
_FIRST_COMMON: Final = {0x02: 1, 0x31: 2}
_EFFECT_PLACES: Final = (11, 22)
"""Of a USB output report: R2 and L2."""
_OFF_CODES: Final = (0x00, 0x05)
_PLAYED_REPORTS: Final = 64


@dataclass(frozen=True)
class Conduct:
    """What one driver did."""

    parse_s: dict[Transport, float]
    """For one input report, all that it makes of it."""
    writes_at_rest_per_s: float
    """While nobody asks for an effect."""
    axes_right: dict[Transport, bool]
    """Gyroscope and accelerometer, each axis where it belongs."""
    touch_right: dict[Transport, bool]
    corrupted_refused: bool
    """A Bluetooth report with a wrong checksum moves nothing."""
    foreign_flags: bool
    """Its writes set what belongs to others: lights, mute key, sound."""
    released_at_close: bool
    debug_codes: bool
    """Its values can make a debug code, which corrupts a trigger until it is reset."""
    after_unplug: str


class Driver(Protocol):
    """One driver under test."""

    name: str

    def examine(self, rounds: int) -> Conduct:
        """Put it through everything; each timing is the best of so many rounds."""
        ...


def best_time_s(read: Callable[[bytes], object], reports: Sequence[bytes], rounds: int) -> float:
    """Of one report, on average over these, in the best of so many rounds."""

    def all_of_them() -> None:
        for report in reports:
            read(report)

    return min(timeit.repeat(all_of_them, number=10, repeat=rounds)) / (10 * len(reports))


def corrupted_report() -> bytes:
    """A Bluetooth report with R2 pulled by a bit error that its checksum gives away."""
    report = bytearray(build_input_report(ControllerState(), Transport.BLUETOOTH))
    report[7] ^= 0x80
    return bytes(report)


def varied_reports(transport: Transport) -> list[bytes]:
    """Reports of which no two are alike, as a hand on the controller makes them."""
    states = (
        ControllerState(
            r2=number / _PLAYED_REPORTS,
            left_stick=(number / _PLAYED_REPORTS - 0.5, 0.25),
            sequence=number,
            gyro_rad_s=(0.01 * number, -0.02 * number, 0.03),
            acceleration_m_s2=(0.1 * number, 9.8, 0.2),
        )
        for number in range(_PLAYED_REPORTS)
    )
    return [build_input_report(state, transport) for state in states]


def sets_foreign_flags(report: bytes) -> bool:
    """Whether an output report has a flag that is not for triggers or rumble."""
    start = _FIRST_COMMON[report[0]]
    return any(report[start + place] & ~ours & 0xFF for place, ours in enumerate(_OUR_FLAGS))


def ends_released(report: bytes) -> bool:
    """Whether a USB output report takes the effects off both triggers."""
    return all(report[place] in _OFF_CODES for place in _EFFECT_PLACES)
