"""A DualSense made of bytes: the same port as a real one on USB, with a simulated person's hands on it."""

import math
from typing import Final

from common.errors import DeviceError, RemoteProtocolError
from operator_side.dualsense.controller_state import (
    SENSOR_TIME_SPAN_S,
    Button,
    ControllerState,
    Stick,
    TriggerFeedback,
)
from operator_side.dualsense.effects import AnyEffect, Off
from operator_side.dualsense.input_report import build_input_report
from operator_side.dualsense.output_report import Rumble, parse_output_report
from operator_side.dualsense.trigger_model import SimulatedTrigger

INPUT_REPORT_PERIOD_S: Final = 0.004
"""About 250 reports a second on USB (SDL)."""

_TRIGGER_BUTTONS: Final = frozenset({Button.L2, Button.R2})
_ROUNDING_OF_TICKS = 1e-6
"""So that a `now_s` of exactly n periods, in floating point, is the n-th report's time."""


class SimulatedDualSense:
    """The Device port without hardware, in virtual or real time: `now_s` is all it knows of clocks.

    It wakes at the first `now_s` it is given and makes an input report at once, then every 4 ms. What the
    `set_*` methods change holds from the last `now_s` on. Forces are those of trigger_model: assumptions.
    """

    def __init__(self) -> None:
        self._l2 = SimulatedTrigger()
        self._r2 = SimulatedTrigger()
        self._rumble = Rumble()
        self._left_stick: Stick = (0.0, 0.0)
        self._right_stick: Stick = (0.0, 0.0)
        self._buttons: frozenset[Button] = frozenset()
        self._woke_s: float | None = None
        self._now_s = 0.0
        self._newest_report = -1
        self._unread: bytes | None = None
        self._write_count = 0
        self._closed = False

    # The person

    def set_finger_force(self, l2_n: float, r2_n: float) -> None:
        """Press the triggers with constant forces; ValueError for a negative or non-finite one."""
        self._l2.set_finger_force(l2_n)
        self._r2.set_finger_force(r2_n)

    def set_sticks(self, left: Stick = (0.0, 0.0), right: Stick = (0.0, 0.0)) -> None:
        """Hold the sticks at (x, y), -1 to 1 each, right and up positive; ValueError beyond."""
        ControllerState(left_stick=left, right_stick=right)
        self._left_stick, self._right_stick = left, right

    def set_buttons(self, pressed: frozenset[Button]) -> None:
        """Hold these buttons and no others; ValueError for L2 and R2, which follow the fingers' force."""
        if pressed & _TRIGGER_BUTTONS:
            raise ValueError("pressed has L2 or R2; valid: any other button, and set_finger_force for these")
        ControllerState(pressed=pressed)
        self._buttons = pressed

    # What a test may look at

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
        return self._rumble

    @property
    def travel(self) -> tuple[float, float]:
        """Mechanical travel of L2 and R2, 0 to 1, at the last `now_s`."""
        return self._l2.travel, self._r2.travel

    @property
    def write_count(self) -> int:
        """Output reports that were accepted from outside."""
        return self._write_count

    # The Device port

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, of the state at its own time, or None until the next one is due.

        ValueError when `now_s` runs backwards or is not finite.
        """
        self._require_open()
        self._advance(now_s)
        report, self._unread = self._unread, None
        return report

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report at `now_s`; ValueError, and nothing changed, for one that cannot be read."""
        self._require_open()
        try:
            output = parse_output_report(report)
        except RemoteProtocolError as error:
            raise ValueError(f"report: {error}") from error
        self._advance(now_s)
        if output.l2 is not None:
            self._l2.set_effect(output.l2)
        if output.r2 is not None:
            self._r2.set_effect(output.r2)
        if output.rumble is not None:
            self._rumble = output.rumble
        self._write_count += 1

    def close(self) -> None:
        """Take effects and rumble off; `read` and `write` raise DeviceError from then on."""
        self._l2.set_effect(Off())
        self._r2.set_effect(Off())
        self._rumble = Rumble()
        self._closed = True

    def _require_open(self) -> None:
        if self._closed:
            raise DeviceError("the simulated controller is closed; open a new one")

    def _advance(self, now_s: float) -> None:
        """Let time pass until `now_s`, and make the newest input report on the way that has come due."""
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite number")
        if self._woke_s is None:
            self._woke_s = self._now_s = now_s
        if now_s < self._now_s:
            raise ValueError(f"now_s = {now_s}; valid: not before {self._now_s}, the last time given")
        due = math.floor((now_s - self._woke_s) / INPUT_REPORT_PERIOD_S + _ROUNDING_OF_TICKS)
        if due > self._newest_report:
            made_s = self._woke_s + due * INPUT_REPORT_PERIOD_S
            self._move_triggers(min(max(made_s, self._now_s), now_s))
            self._unread = build_input_report(self._state(due))
            self._newest_report = due
        self._move_triggers(now_s)

    def _move_triggers(self, to_s: float) -> None:
        self._l2.advance(to_s - self._now_s)
        self._r2.advance(to_s - self._now_s)
        self._now_s = to_s

    def _state(self, report_number: int) -> ControllerState:
        triggers = {Button.L2: self._l2, Button.R2: self._r2}
        moved = {button for button, trigger in triggers.items() if round(trigger.sensed_travel * 255) > 0}
        return ControllerState(
            left_stick=self._left_stick,
            right_stick=self._right_stick,
            l2=self._l2.sensed_travel,
            r2=self._r2.sensed_travel,
            pressed=self._buttons | moved,
            sequence=report_number % 256,
            sensor_time_s=report_number * INPUT_REPORT_PERIOD_S % SENSOR_TIME_SPAN_S,
            l2_feedback=_feedback(self._l2),
            r2_feedback=_feedback(self._r2),
        )


def _feedback(trigger: SimulatedTrigger) -> TriggerFeedback:
    """What the trigger reports of itself under a feedback effect; that it is the present zone is assumed."""
    if isinstance(trigger.effect, Off):
        return TriggerFeedback()
    return TriggerFeedback(stop_location=trigger.zone, status=int(trigger.loaded), active_effect=1)
