"""Simulated DualSense, with the same interface as a real one; methods set forces, sticks and buttons."""

import math
from typing import Final

from msgspec.structs import replace

from common.errors import DeviceError, RemoteProtocolError
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble, Strengths
from operator_side.controller.state import Battery, BatteryState, Button, ControllerState, Stick
from operator_side.dualsense.reports.feature_report import (
    ADDRESS_ID,
    CALIBRATION_ID,
    FIRMWARE_ID,
    Firmware,
    build_address,
    build_calibration,
)
from operator_side.dualsense.reports.input_report import build_input_report, parse_input_report
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.output_report import parse_output_report, transport_of_output
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.trigger_model import (
    FINGER_TIME_CONSTANT_S,
    STRENGTH_STEP_N,
    SimulatedTrigger,
    zone_of,
)

INPUT_REPORT_PERIOD_S: Final = 0.004
"""Period of input reports, in seconds: about 250 a second, as on USB (SDL)"""
SIMULATED_ADDRESS: Final = "02:00:00:00:0c:e6"
"""Locally administered address, so that no real controller has it"""
SIMULATED_FIRMWARE: Final = Firmware(hardware_version=0x0413, firmware_version=0x0110_0224, update_version=0x0224)
"""Invented versions; hid-playstation's newer rumble mode needs an update version of at least 2.21 (0x0215)"""

_ROUNDING_OF_TICKS = 1e-6
"""Tolerance, in periods, so that rounding of `now_s` does not miss a report that is just due"""
_BLUETOOTH_SEQUENCE = 1
"""Sequence number in the common block, constant on Bluetooth (controllers wiki)"""
_PULLED: Final = 1e-3
"""Least travel of a trigger that counts as pulled: a released one comes back to 0 exponentially"""
_TRIGGER_BUTTONS: Final = frozenset({Button.L2, Button.R2})
_EDGE_BUTTONS: Final = frozenset({Button.LEFT_FUNCTION, Button.RIGHT_FUNCTION, Button.LEFT_PADDLE, Button.RIGHT_PADDLE})


class SimulatedDualSense:
    """Simulated DualSense, in virtual or real time: `now_s` is its only clock.

    At the first `now_s` it makes an input report, then one each period. A value given to a `set_*` method holds from
    the last `now_s` until it is set again; at first nothing is touched. Forces are the assumptions of trigger_model.py.
    On Bluetooth it sends full reports from the start.
    """

    def __init__(
        self,
        transport: Transport = Transport.USB,
        model: Model = Model.DUALSENSE,
        *,
        address: str = SIMULATED_ADDRESS,
        strength_step_n: float = STRENGTH_STEP_N,
        finger_s: float = FINGER_TIME_CONSTANT_S,
    ) -> None:
        """strength_step_n: force that each step of strength, 0 to 8, adds to a trigger's resistance.

        finger_s: time constant of the fingers on the triggers, above 0. ValueError for an invalid address.
        """
        self.transport: Final = transport
        self.model: Final = model
        self.address: Final = address
        self._l2 = SimulatedTrigger(strength_step_n, finger_s)
        self._r2 = SimulatedTrigger(strength_step_n, finger_s)
        wireless = transport is Transport.BLUETOOTH
        self._held = ControllerState(battery=Battery(0.95, BatteryState.DISCHARGING) if wireless else Battery())
        self._features = {
            CALIBRATION_ID: build_calibration(transport),
            ADDRESS_ID: build_address(address, transport),
            FIRMWARE_ID: SIMULATED_FIRMWARE.build(transport),
        }
        self._now_s = -math.inf
        self._closed = False
        self._woke_s: float | None = None
        self._newest_report = -1
        self._unread: bytes | None = None
        self.commanded = RELEASED
        """Present effects; a part is None if it was never set."""
        self._apply(RELEASED)

    # Inputs by a person

    def set_finger_force(self, l2_n: float, r2_n: float) -> None:
        """Press L2 and R2 with constant forces from now on; ValueError for a negative or non-finite force."""
        self._l2.set_finger_force(l2_n)
        self._r2.set_finger_force(r2_n)

    def set_sticks(self, left: Stick = (0.0, 0.0), right: Stick = (0.0, 0.0)) -> None:
        """Hold the sticks at (x, y), -1 to 1 each, right and up positive; ValueError for values out of range."""
        if (left, right) != (self._held.left_stick, self._held.right_stick):
            self._held = replace(self._held, left_stick=left, right_stick=right)

    def set_buttons(self, pressed: frozenset[Button]) -> None:
        """Hold these buttons and no others.

        ValueError for L2 and R2, which the triggers' travel presses, and for function keys or paddles unless the model
        is a DualSense Edge.
        """
        if pressed & _TRIGGER_BUTTONS:
            raise ValueError("pressed holds L2 or R2; valid: other buttons (set_finger_force pulls L2 and R2)")
        if pressed & _EDGE_BUTTONS and self.model is not Model.EDGE:
            raise ValueError(
                "pressed holds a paddle or a function key; valid: other buttons, as only a DualSense Edge has these"
            )
        if pressed != self._held.pressed:
            self._held = replace(self._held, pressed=pressed)

    def hands_off(self) -> None:
        """Release triggers, sticks and buttons."""
        self.set_finger_force(0.0, 0.0)
        self.set_sticks()
        self.set_buttons(frozenset())

    # State

    @property
    def travel(self) -> tuple[float, float]:
        """Mechanical travel of L2 and R2, 0 to 1, at the last `now_s`."""
        return self._l2.travel, self._r2.travel

    @property
    def strengths(self) -> tuple[Strengths, Strengths]:
        """Present strengths of L2's and of R2's zones."""
        return self._l2.strengths, self._r2.strengths

    @property
    def strength(self) -> tuple[int, int]:
        """Strengths, 0 to 8, of the zones that L2 and R2 have reached; 0 for a trigger that is not pulled."""
        l2, r2 = (
            strengths[zone_of(travel)] if travel > _PULLED else 0
            for strengths, travel in zip(self.strengths, self.travel, strict=True)
        )
        return l2, r2

    @property
    def released(self) -> bool:
        """Whether neither trigger has a strength above 0 in any zone."""
        return self.strengths == (FREE_TRIGGER, FREE_TRIGGER)

    @property
    def rumble(self) -> Rumble:
        """Present drive of the motors."""
        return self.commanded.rumble or Rumble()

    # Interface of `Controller` (operator_side/controller/port.py)

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state in the newest input report, rounded as in the report; None if there is no new report.

        Errors are those of `read_report`.
        """
        report = self.read_report(now_s)
        return None if report is None else parse_input_report(report)

    def write(self, feel: Feel, now_s: float) -> None:
        """Apply `feel` from `now_s` on; DeviceError if the controller is closed."""
        self._require_open()
        self._advance(now_s)
        self._apply(feel)

    def close(self) -> None:
        """Switch off resistance, rumble and a warning light; from then on `read` and `write` raise DeviceError."""
        self._apply(self.commanded.farewell)
        self._closed = True

    # Reports as bytes, for an operating system to which this controller is offered

    def read_report(self, now_s: float) -> bytes | None:
        """Return the newest input report, with the state at the time when it was due; None if there is no new report.

        ValueError if `now_s` runs backwards or is not finite; DeviceError if the controller is closed.
        """
        self._require_open()
        self._advance(now_s)
        report, self._unread = self._unread, None
        return report

    def apply_report(self, report: bytes, now_s: float) -> None:
        """Apply an output report; if it cannot be decoded, change nothing and raise ValueError."""
        self._require_open()
        try:
            if transport_of_output(report) is not self.transport:
                raise ValueError(
                    f"report: id 0x{report[0]:02x} is of another transport; valid: a report for {self.transport.value}"
                )
            feel = parse_output_report(report)
        except RemoteProtocolError as error:
            raise ValueError(f"report: {error}") from error
        self.write(feel, now_s)

    def get_feature(self, report_id: int) -> bytes:
        """Return a feature report: calibration 0x05, address 0x09 or firmware 0x20.

        DeviceError for another id, or if the controller is closed.
        """
        self._require_open()
        if report_id not in self._features:
            valid = ", ".join(f"0x{known:02x}" for known in self._features)
            raise DeviceError(f"the simulated controller has no feature report 0x{report_id:02x}; valid: {valid}")
        return self._features[report_id]

    def _require_open(self) -> None:
        if self._closed:
            raise DeviceError("the simulated controller is closed; open a new one")

    def _apply(self, feel: Feel) -> None:
        self.commanded = feel.completed_from(self.commanded)
        self._l2.set_strengths(self.commanded.l2 or FREE_TRIGGER)
        self._r2.set_strengths(self.commanded.r2 or FREE_TRIGGER)

    def _advance(self, now_s: float) -> None:
        """Move the triggers until `now_s`, and make the newest input report that is due."""
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite number")
        if now_s < self._now_s:
            raise ValueError(f"now_s = {now_s}; valid: {self._now_s}, the last time given, or later")
        if self._woke_s is None:
            self._woke_s = self._now_s = now_s
        due = math.floor((now_s - self._woke_s) / INPUT_REPORT_PERIOD_S + _ROUNDING_OF_TICKS)
        if due > self._newest_report:
            made_s = self._woke_s + due * INPUT_REPORT_PERIOD_S
            self._move_triggers(min(max(made_s, self._now_s), now_s))
            self._unread = self._report(due)
            self._newest_report = due
        self._move_triggers(now_s)

    def _move_triggers(self, to_s: float) -> None:
        self._l2.advance(to_s - self._now_s)
        self._r2.advance(to_s - self._now_s)
        self._now_s = to_s

    def _report(self, number: int) -> bytes:
        sequence = number % 256 if self.transport is Transport.USB else _BLUETOOTH_SEQUENCE
        return build_input_report(self._state(), self.transport, sequence, number * INPUT_REPORT_PERIOD_S)

    def _state(self) -> ControllerState:
        """Return the present state: sticks and buttons as set, triggers by their travel."""
        triggers = {Button.L2: self._l2, Button.R2: self._r2}
        moved = {button for button, trigger in triggers.items() if round(trigger.sensed_travel * 255) > 0}
        return replace(
            self._held,
            l2=self._l2.sensed_travel,
            r2=self._r2.sensed_travel,
            pressed=self._held.pressed | moved,
        )
