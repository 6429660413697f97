"""Controllers that disobey: spoilt, to see that a figure notices, or always full."""

from collections import deque
from dataclasses import replace
from typing import Literal

from operator_side.controller.feel import MAX_STRENGTH, ZONE_COUNT, Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense

Spoil = Literal["nothing", "delayed", "swapped"]
"""delayed: strengths come 100 ms late. swapped: each trigger has the other's strengths."""
_FULL = Feel(l2=(MAX_STRENGTH,) * ZONE_COUNT, r2=(MAX_STRENGTH,) * ZONE_COUNT)
SPOILING_DELAY_S = 0.1


class DelayedDualSense(SimulatedDualSense):
    """A controller that follows 100 ms later."""

    def __init__(self, strength_step_n: float) -> None:
        super().__init__(strength_step_n=strength_step_n)
        self._waiting: deque[tuple[float, Feel]] = deque()

    def write(self, feel: Feel, now_s: float) -> None:
        """Take what it is told, to follow it later."""
        self._waiting.append((now_s + SPOILING_DELAY_S, feel))
        self._follow(now_s)

    def read(self, now_s: float) -> ControllerState | None:
        """Read the state."""
        self._follow(now_s)
        return super().read(now_s)

    def _follow(self, now_s: float) -> None:
        while self._waiting and self._waiting[0][0] <= now_s:
            super().write(self._waiting.popleft()[1], now_s)


class SwappedDualSense(SimulatedDualSense):
    """A controller with the triggers' strengths exchanged."""

    def write(self, feel: Feel, now_s: float) -> None:
        """Do what it is told with the triggers' strengths exchanged."""
        super().write(replace(feel, l2=feel.r2, r2=feel.l2), now_s)


class FullDualSense(SimulatedDualSense):
    """A controller that always resists with full strength."""

    def write(self, feel: Feel, now_s: float) -> None:
        """Do something else than it is told."""
        del feel
        super().write(_FULL, now_s)

    def read(self, now_s: float) -> ControllerState | None:
        """Read the state; it resists from the first time on."""
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
