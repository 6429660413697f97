"""Controllers that disobey: spoilt, to see that a figure notices, or always full."""

from collections import deque
from dataclasses import replace
from typing import Literal

from operator_side.dualsense.effects.official import MAX_STRENGTH, ZONE_COUNT, MultiPositionFeedback
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report, parse_output_report
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
        self._waiting: deque[tuple[float, bytes]] = deque()

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report, to follow it later."""
        self._waiting.append((now_s + SPOILING_DELAY_S, report))
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

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report, with the triggers' effects exchanged."""
        told = parse_output_report(report, unofficial=True)
        super().write(build_output_report(replace(told, l2=told.r2, r2=told.l2)), now_s)


class FullDualSense(SimulatedDualSense):
    """A controller that always resists with the strongest effect."""

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report, and do something else."""
        del report
        super().write(build_output_report(_FULL), now_s)

    def read(self, now_s: float) -> bytes | None:
        """Read an input report; it resists from the first time on."""
        if self.released:
            super().write(build_output_report(_FULL), now_s)
        return super().read(now_s)


def controller(strength_step_n: float, spoil: Spoil | Literal["full"] = "nothing") -> SimulatedDualSense:
    """Make a simulated controller, spoilt as asked."""
    if spoil == "full":
        return FullDualSense(strength_step_n=strength_step_n)
    if spoil == "delayed":
        return DelayedDualSense(strength_step_n)
    kind = SwappedDualSense if spoil == "swapped" else SimulatedDualSense
    return kind(strength_step_n=strength_step_n)
