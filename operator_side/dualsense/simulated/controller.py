"""A DualSense made of bytes: the same port as a real one, with a simulated person's hands on it."""

import math
from typing import Final

from common.errors import DeviceError, RemoteProtocolError
from operator_side.dualsense.effects.official import AnyEffect, Off
from operator_side.dualsense.reports.attachments import CHARGED, ON_BLUETOOTH, ON_USB, Battery, BatteryState
from operator_side.dualsense.reports.checksum import Seed, is_sealed
from operator_side.dualsense.reports.feature_report import (
    ADDRESS_ID,
    CALIBRATION_ID,
    FEATURE_LENGTHS,
    FIRMWARE_ID,
    CalibrationReport,
    Firmware,
    build_address,
)
from operator_side.dualsense.reports.input_report import build_input_report, build_simple_input_report
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.motion_sensors import MotionCalibration
from operator_side.dualsense.reports.output_report import (
    RELEASED,
    OutputReport,
    Rumble,
    parse_output_report,
    transport_of_output,
)
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.simulated_hands import SimulatedHands
from operator_side.dualsense.simulated.trigger_model import STRENGTH_STEP_N

INPUT_REPORT_PERIOD_S: Final = 0.004
"""About 250 reports a second on USB (SDL)."""
SIMULATED_ADDRESS: Final = "02:00:00:00:0c:e6"
"""Locally administered, so that it is no real controller's."""
SIMULATED_FIRMWARE: Final = Firmware(hardware_version=0x0413, firmware_version=0x0110_0224, update_version=0x0224)
"""Made up, but new enough for Linux hid-playstation's present way to rumble (2.21, so 0x0215)."""
IDEAL_CALIBRATION: Final = CalibrationReport(
    gyro_bias=(0, 0, 0),
    gyro_plus=(8640, 8640, 8640),
    gyro_minus=(-8640, -8640, -8640),
    speed_plus=540,
    speed_minus=540,
    acceleration_plus=(8192, 8192, 8192),
    acceleration_minus=(-8192, -8192, -8192),
)
"""That of sensors without error: the nominal resolution of hid-playstation."""

_ROUNDING_OF_TICKS = 1e-6
"""So that a `now_s` of exactly n periods, in floating point, is the n-th report's time."""
_BLUETOOTH_SEQUENCE = 1
"""What the common block says on Bluetooth, always (controllers wiki)."""
_FULL_MODE_FEATURES = frozenset({ADDRESS_ID, FIRMWARE_ID})


class SimulatedDualSense(SimulatedHands):
    """The Device port without hardware, in virtual or real time: `now_s` is all it knows of clocks.

    It wakes at the first `now_s` it is given and makes an input report at once, then one a period. What the
    `set_*` methods change holds from the last `now_s` on. On Bluetooth it starts with the simple reports.
    """

    def __init__(
        self,
        transport: Transport = Transport.USB,
        model: Model = Model.DUALSENSE,
        *,
        bluetooth_period_s: float = INPUT_REPORT_PERIOD_S,
        address: str = SIMULATED_ADDRESS,
        calibration: CalibrationReport = IDEAL_CALIBRATION,
        strength_step_n: float = STRENGTH_STEP_N,
    ) -> None:
        """`bluetooth_period_s`: a controller sends up to 1000 reports a second there (SDL), 250 on USB.

        `strength_step_n`: the resistance that one strength of its triggers' effects adds, an eighth of the strongest.
        `calibration`: what its motion sensors really are like, and what feature 0x05 says of them. ValueError for
        a period that is not above 0, or an address that is none.
        """
        if not (math.isfinite(bluetooth_period_s) and bluetooth_period_s > 0.0):
            raise ValueError(f"bluetooth_period_s = {bluetooth_period_s}; valid: finite, above 0")
        wireless = transport is Transport.BLUETOOTH
        super().__init__(
            model,
            Battery(0.95, BatteryState.DISCHARGING) if wireless else CHARGED,
            ON_BLUETOOTH if wireless else ON_USB,
            strength_step_n,
        )
        self._transport = transport
        self._period_s = bluetooth_period_s if wireless else INPUT_REPORT_PERIOD_S
        self._motion = MotionCalibration.of(calibration)
        self._features = {
            CALIBRATION_ID: calibration.build(transport),
            ADDRESS_ID: build_address(address, transport),
            FIRMWARE_ID: SIMULATED_FIRMWARE.build(transport),
        }
        self._address = address
        self._now_s = -math.inf
        self._write_count = 0
        self._bad_checksums = 0
        self._closed = False
        self._plugged_in = True
        self._start()

    def _start(self) -> None:
        """As the controller is once it has found its host."""
        self._woke_s: float | None = None
        self._newest_report = -1
        self._unread: bytes | None = None
        self._simple = self._transport is Transport.BLUETOOTH
        self._told = RELEASED
        self._apply(RELEASED)

    # What a test may look at

    @property
    def transport(self) -> Transport:
        """What carries its reports."""
        return self._transport

    @property
    def model(self) -> Model:
        """Which controller it is."""
        return self._model

    @property
    def address(self) -> str:
        """What feature 0x09 says."""
        return self._address

    @property
    def output(self) -> OutputReport:
        """All that it has been told and still does; None where nothing was."""
        return self._told

    @property
    def effects(self) -> tuple[AnyEffect, AnyEffect]:
        """The effects in force, L2 and R2, as decoded from the bytes."""
        return self._l2.effect, self._r2.effect

    @property
    def released(self) -> bool:
        """Both triggers are free of any effect."""
        return self.effects == (Off(), Off())

    @property
    def rumble(self) -> Rumble:
        """The motors' present drive."""
        return self._told.rumble or Rumble()

    @property
    def write_count(self) -> int:
        """Output reports that were accepted from outside."""
        return self._write_count

    @property
    def bad_checksums(self) -> int:
        """Output reports that were ignored, as their checksum was wrong."""
        return self._bad_checksums

    @property
    def simple_mode(self) -> bool:
        """It sends Bluetooth's simple reports: nobody has asked for more."""
        return self._simple

    # The cable, or the radio

    def unplug(self) -> None:
        """Be gone: whatever is asked of it raises DeviceError. It forgets what it was told (assumed)."""
        self._plugged_in = False
        self._start()

    def plug_in(self) -> None:
        """Be there again, as at first and as newly opened, even if it was closed in the meantime."""
        self._plugged_in = True
        self._closed = False
        self._start()

    # The Device port

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, of the state at its own time, or None until the next one is due.

        ValueError when `now_s` runs backwards or is not finite; DeviceError when it is unplugged or closed.
        """
        self._require_open()
        self._advance(now_s)
        report, self._unread = self._unread, None
        return report

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report at `now_s`; ValueError, and nothing changed, for one that cannot be read.

        On Bluetooth one with a wrong checksum is counted and ignored, as nobody would tell the writer. DeviceError
        when it is unplugged or closed.
        """
        self._require_open()
        try:
            if transport_of_output(report) is not self._transport:
                raise ValueError(f"report: id 0x{report[0]:02x} is not for a controller on {self._transport.value}")
            if self._transport is Transport.BLUETOOTH and not is_sealed(Seed.OUTPUT, report):
                self._advance(now_s)
                self._bad_checksums += 1
                return
            output = parse_output_report(report, unofficial=True)
        except RemoteProtocolError as error:
            raise ValueError(f"report: {error}") from error
        self._advance(now_s)
        self._simple = False
        self._apply(output)
        self._write_count += 1

    def get_feature(self, report_id: int) -> bytes:
        """Answer a feature report: calibration 0x05, address 0x09, firmware 0x20.

        The latter two end Bluetooth's simple mode. DeviceError for another id, and when it is unplugged or closed.
        """
        self._require_open()
        if report_id not in self._features:
            valid = ", ".join(f"0x{known:02x}" for known in FEATURE_LENGTHS)
            raise DeviceError(f"the simulated controller has no feature report 0x{report_id:02x}; valid: {valid}")
        if report_id in _FULL_MODE_FEATURES:
            self._simple = False
        return self._features[report_id]

    def close(self) -> None:
        """Take effects, rumble and a warning light off; `read` and `write` raise DeviceError from then on."""
        self._apply(self._told.farewell)
        self._closed = True

    def _require_open(self) -> None:
        if not self._plugged_in:
            raise DeviceError("the simulated controller is gone (unplugged): plug it in again")
        if self._closed:
            raise DeviceError("the simulated controller is closed; open a new one")

    def _apply(self, output: OutputReport) -> None:
        self._told = output.following(self._told)
        power = 1.0 - (self._told.trigger_power_reduction or 0) / 8.0
        self._l2.set_effect(self._told.l2 or Off(), power)
        self._r2.set_effect(self._told.r2 or Off(), power)

    def _advance(self, now_s: float) -> None:
        """Let time pass until `now_s`, and make the newest input report on the way that has come due."""
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite number")
        if now_s < self._now_s:
            raise ValueError(f"now_s = {now_s}; valid: not before {self._now_s}, the last time given")
        if self._woke_s is None:
            self._woke_s = self._now_s = now_s
        due = math.floor((now_s - self._woke_s) / self._period_s + _ROUNDING_OF_TICKS)
        if due > self._newest_report:
            made_s = self._woke_s + due * self._period_s
            self._move_triggers(min(max(made_s, self._now_s), now_s))
            self._unread = self._report(due)
            self._newest_report = due
        self._move_triggers(now_s)

    def _move_triggers(self, to_s: float) -> None:
        self._l2.advance(to_s - self._now_s)
        self._r2.advance(to_s - self._now_s)
        self._now_s = to_s

    def _report(self, number: int) -> bytes:
        clock_s = number * self._period_s
        if self._simple:
            return build_simple_input_report(self._state(number % 64, clock_s))
        sequence = number % 256 if self._transport is Transport.USB else _BLUETOOTH_SEQUENCE
        return build_input_report(self._state(sequence, clock_s), self._transport, self._motion)
