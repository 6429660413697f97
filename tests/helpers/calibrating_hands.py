"""Simulated user who follows the steps of a controller's calibration; the test chooses how worn the controller is."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from operator_side.calibration.procedure import CalibrationProcedure, Step
from operator_side.controller.state import ControllerState, Stick

REPORT_S = 0.004
_PULL_S = 0.8


@dataclass(frozen=True)
class Wear:
    """Values that a worn controller reports: triggers at rest and at full pull, with uniform noise of ±`noise`."""

    l2: tuple[float, float] = (0.0, 1.0)
    r2: tuple[float, float] = (0.0, 1.0)
    left: tuple[Stick, Stick] = ((0.0, 0.0), (0.0, 0.0))
    """Resting position of the stick, before and after its first movement."""
    right: tuple[Stick, Stick] = ((0.0, 0.0), (0.0, 0.0))
    noise: float = 0.0


PullDepth = Callable[[str, int], float]
"""Function of a trigger's name and the number of the pull; returns the pull's depth as a share of the full travel."""


def fully(trigger: str, number: int) -> float:
    del trigger, number
    return 1.0


class CalibratingUser:
    """Simulated user: pulls a trigger or turns the sticks, as the present step of the calibration asks."""

    def __init__(self, wear: Wear, depth: PullDepth = fully, seed: int = 0) -> None:
        self.procedure = CalibrationProcedure()
        self.now_s = 0.0
        self.complaints: list[str] = []
        self._wear = wear
        self._depth = depth
        self._generator = np.random.default_rng(seed)
        self._pulls = {"l2": 0, "r2": 0}
        self._step_s = 0.0
        self._moved = False

    def run(self, longest_s: float = 200.0) -> CalibrationProcedure:
        """Run the calibration until it is done, but at most `longest_s` of virtual time."""
        while self.procedure.step is not Step.DONE and self.now_s < longest_s:
            before = self.procedure.step
            self.procedure.feed(self._state(), self.now_s)
            if self.procedure.complaint is not None and self.procedure.complaint not in self.complaints:
                self.complaints.append(self.procedure.complaint)
            if self.procedure.step is not before:
                self._step_s = self.now_s
                self._moved |= before is Step.STICKS
            self.now_s += REPORT_S
        return self.procedure

    def _state(self) -> ControllerState:
        pulled = {"l2": 0.0, "r2": 0.0}
        for name, step in (("l2", Step.PULL_L2), ("r2", Step.PULL_R2)):
            if self.procedure.step is step:
                number, phase = divmod((self.now_s - self._step_s) / _PULL_S, 1.0)
                pulled[name] = self._depth(name, int(number)) * math.sin(math.pi * phase) ** 2
        sticks = [stick[self._moved] for stick in (self._wear.left, self._wear.right)]
        if self.procedure.step is Step.STICKS:
            turn = 2.0 * math.pi * (self.now_s - self._step_s)
            sticks = [(math.cos(turn), math.sin(turn))] * 2
        return ControllerState(
            left_stick=self._jittered(sticks[0]),
            right_stick=self._jittered(sticks[1]),
            l2=self._raw(self._wear.l2, pulled["l2"]),
            r2=self._raw(self._wear.r2, pulled["r2"]),
        )

    def _raw(self, ends: tuple[float, float], pulled: float) -> float:
        raw = ends[0] + pulled * (ends[1] - ends[0]) + self._noise()
        return min(max(raw, 0.0), 1.0)

    def _jittered(self, stick: Stick) -> Stick:
        x, y = (min(max(axis + self._noise(), -1.0), 1.0) for axis in stick)
        return x, y

    def _noise(self) -> float:
        return float(self._generator.uniform(-self._wear.noise, self._wear.noise))
