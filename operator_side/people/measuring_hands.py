"""Scripted person with a kitchen scale, who measures the forces of a simulated controller."""

from operator_side.calibration.force_measurement import ForceMeasurement
from operator_side.dualsense.simulated.controller import SimulatedDualSense

_PAUSE_S = 0.5
_RISE_N_S = 1.0
_GRAMS_PER_NEWTON = 1000.0 / 9.80665


class MeasuringHands:
    """Scripted person who presses with a slowly rising force until the trigger yields, and types the scale's grams."""

    def __init__(self, device: SimulatedDualSense) -> None:
        self._device = device
        self._strength: int | None = None
        self._since_s = 0.0

    def act(self, measurement: ForceMeasurement, now_s: float) -> str:
        """Press the trigger at `now_s`; return the characters that are typed, mostly none."""
        if measurement.strength != self._strength:
            self._strength, self._since_s = measurement.strength, now_s
        force_n = max(0.0, now_s - self._since_s - _PAUSE_S) * _RISE_N_S
        left = measurement.trigger == "l2"
        self._device.set_finger_force(force_n if left else 0.0, 0.0 if left else force_n)
        return f"{force_n * _GRAMS_PER_NEWTON:.0f}\n" if measurement.yielded else ""
