"""What a simulated person does with a controller, and what its sensors make of that."""

from dataclasses import replace
from typing import Final

from operator_side.dualsense.reports.attachments import Battery, Connections, TouchPoint
from operator_side.dualsense.reports.controller_state import (
    AT_REST_M_S2,
    SENSED_TRAVEL,
    SENSOR_TICKS_PER_S,
    SENSOR_TIME_SPAN_S,
    Button,
    ControllerState,
    Stick,
    Vector3,
)
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.simulated.trigger_model import STRENGTH_STEP_N, SimulatedTrigger

_TRIGGER_BUTTONS: Final = frozenset({Button.L2, Button.R2})
_EDGE_BUTTONS: Final = frozenset({Button.LEFT_FUNCTION, Button.RIGHT_FUNCTION, Button.LEFT_PADDLE, Button.RIGHT_PADDLE})


class SimulatedHands:
    """Hands, pad, motion and battery; everything set here holds until it is set anew.

    At first nobody touches the controller, and it lies flat. Forces are those of trigger_model: assumptions.
    """

    def __init__(
        self, model: Model, battery: Battery, connections: Connections, strength_step_n: float = STRENGTH_STEP_N
    ) -> None:
        self._model = model
        self._l2 = SimulatedTrigger(strength_step_n)
        self._r2 = SimulatedTrigger(strength_step_n)
        self._held = ControllerState(battery=battery, connections=connections)

    def set_finger_force(self, l2_n: float, r2_n: float) -> None:
        """Press the triggers with constant forces; ValueError for a negative or non-finite one."""
        self._l2.set_finger_force(l2_n)
        self._r2.set_finger_force(r2_n)

    def set_travel(self, l2: float, r2: float) -> None:
        """Hold the triggers at these travels as the controller reports them, 0 to 1, whatever resists, until a force
        is set; ValueError beyond.
        """
        self._l2.hold_at(SENSED_TRAVEL * l2)
        self._r2.hold_at(SENSED_TRAVEL * r2)

    def set_sticks(self, left: Stick = (0.0, 0.0), right: Stick = (0.0, 0.0)) -> None:
        """Hold the sticks at (x, y), -1 to 1 each, right and up positive; ValueError beyond."""
        if (left, right) != (self._held.left_stick, self._held.right_stick):
            self._held = replace(self._held, left_stick=left, right_stick=right)

    def set_buttons(self, pressed: frozenset[Button]) -> None:
        """Hold these buttons and no others.

        ValueError for L2 and R2, which follow the fingers' force, and for the Edge's on a controller without them.
        """
        if pressed & _TRIGGER_BUTTONS:
            raise ValueError("pressed has L2 or R2; valid: any other button, and set_finger_force for these")
        if pressed & _EDGE_BUTTONS and self._model is not Model.EDGE:
            raise ValueError("pressed has a paddle or a function key; valid: only on a DualSense Edge")
        if pressed != self._held.pressed:
            self._held = replace(self._held, pressed=pressed)

    def set_motion(self, gyro_rad_s: Vector3 = (0.0, 0.0, 0.0), acceleration_m_s2: Vector3 = AT_REST_M_S2) -> None:
        """Turn and accelerate the controller, gravity's reaction included; ValueError for a non-finite one."""
        self._held = replace(self._held, gyro_rad_s=gyro_rad_s, acceleration_m_s2=acceleration_m_s2)

    def set_touches(self, *touches: TouchPoint) -> None:
        """Touch the pad with these fingers and no others; ValueError for more than two."""
        self._held = replace(self._held, touches=touches)

    def set_battery(self, battery: Battery) -> None:
        """Report this battery."""
        self._held = replace(self._held, battery=battery)

    def set_connections(self, connections: Connections) -> None:
        """Report these as plugged in."""
        self._held = replace(self._held, connections=connections)

    @property
    def travel(self) -> tuple[float, float]:
        """Mechanical travel of L2 and R2, 0 to 1, at the last time given."""
        return self._l2.travel, self._r2.travel

    def _state(self, sequence: int, clock_s: float) -> ControllerState:
        """What the sensors say `clock_s` after the controller woke."""
        triggers = {Button.L2: self._l2, Button.R2: self._r2}
        moved = {button for button, trigger in triggers.items() if round(trigger.sensed_travel * 255) > 0}
        return replace(
            self._held,
            l2=self._l2.sensed_travel,
            r2=self._r2.sensed_travel,
            pressed=self._held.pressed | moved,
            sequence=sequence,
            sensor_time_s=clock_s % SENSOR_TIME_SPAN_S,
            l2_feedback=self._l2.feedback,
            r2_feedback=self._r2.feedback,
            device_timestamp=round(clock_s * SENSOR_TICKS_PER_S) % 2**32,
        )
