"""Controllers that disobey: spoilt, to see that a figure notices, or always full."""

from collections import deque
from dataclasses import replace
from typing import Literal

from operator_side.dualsense.effects.official import MAX_STRENGTH, ZONE_COUNT, MultiPositionFeedback
from operator_side.dualsense.reports.output_report import OutputReport
from operator_side.dualsense.simulated.controller import SimulatedDualSense

Spoil = Literal["nothing", "delayed", "swapped"]
"""delayed: effects come 100 ms late. swapped: each trigger has the other's effect."""
_FULL = OutputReport(
    l2=MultiPositionFeedback((MAX_STRENGTH,) * ZONE_COUNT), r2=MultiPositionFeedback((MAX_STRENGTH,) * ZONE_COUNT)
)
SPOILING_DELAY_S = 0.1


class DelayedDualSense(SimulatedDualSense):
    """A controller that follows 100 ms later."""

    def __init__(self, strength_step_n: float) -> None:
        super().__init__(strength_step_n=strength_step_n)
        self._waiting: deque[tuple[float, OutputReport]] = deque()

    def write(self, output: OutputReport, now_s: float) -> None:
        """Take what it is told, to follow it later."""
        self._waiting.append((now_s + SPOILING_DELAY_S, output))
        self._follow(now_s)

    def read(self, now_s: float) -> bytes | None:
        """Read an input report."""
        self._follow(now_s)
        return super().read(now_s)

    def _follow(self, now_s: float) -> None:
        while self._waiting and self._waiting[0][0] <= now_s:
            super().write(self._waiting.popleft()[1], now_s)


class SwappedDualSense(SimulatedDualSense):
    """A controller with the triggers' effects exchanged."""

    def write(self, output: OutputReport, now_s: float) -> None:
        """Do what it is told with the triggers' effects exchanged."""
        super().write(replace(output, l2=output.r2, r2=output.l2), now_s)


class FullDualSense(SimulatedDualSense):
    """A controller that always resists with the strongest effect."""

    def write(self, output: OutputReport, now_s: float) -> None:
        """Do something else than it is told."""
        del output
        super().write(_FULL, now_s)

    def read(self, now_s: float) -> bytes | None:
        """Read an input report; it resists from the first time on."""
        if self.released:
            super().write(_FULL, now_s)
        return super().read(now_s)


def controller(strength_step_n: float, spoil: Spoil | Literal["full"] = "nothing") -> SimulatedDualSense:
    """Make a simulated controller, spoilt as asked."""
    if spoil == "full":
        return FullDualSense(strength_step_n=strength_step_n)
    if spoil == "delayed":
        return DelayedDualSense(strength_step_n)
    kind = SwappedDualSense if spoil == "swapped" else SimulatedDualSense
    return kind(strength_step_n=strength_step_n)
