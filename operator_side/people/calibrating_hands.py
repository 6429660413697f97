"""Scripted person who calibrates a simulated controller."""

import math
from typing import Final

from operator_side.calibration.procedure import Step
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N

_PULL_S: Final = 0.8
_TURN_S: Final = 1.5


class CalibratingHands:
    """Scripted person who follows each step of a calibration: rest, pull and release, move the sticks."""

    def __init__(self, device: SimulatedDualSense) -> None:
        self._device = device
        self._step: Step | None = None
        self._since_s = 0.0

    def act(self, step: Step, now_s: float) -> None:
        """Press the triggers or move the sticks at `now_s` as `step` requires."""
        if step is not self._step:
            self._step, self._since_s = step, now_s
        elapsed_s = now_s - self._since_s
        # Released in the first half of each period, so that the first pull begins after a pause.
        pulling = elapsed_s % _PULL_S > 0.5 * _PULL_S
        force_n = NORMAL_FINGER_FORCE_N if pulling else 0.0
        self._device.set_finger_force(force_n * (step is Step.PULL_L2), force_n * (step is Step.PULL_R2))
        stick = (0.0, 0.0)
        if step is Step.STICKS:
            angle = 2.0 * math.pi * elapsed_s / _TURN_S
            stick = (math.cos(angle), math.sin(angle))
        self._device.set_sticks(left=stick, right=stick)
