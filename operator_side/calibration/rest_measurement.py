"""One second in which nobody touches the controller: where everything rests, and how much it jitters."""

import math
from dataclasses import dataclass
from typing import Final

from operator_side.dualsense.reports.controller_state import ControllerState, Stick

REST_S: Final = 1.0
_LEAST_REPORTS: Final = 20
_STILL: Final = 0.06
"""What changes by more than this within the second is being moved."""
_CHANNELS: Final = ("L2", "R2", "the left stick", "the left stick", "the right stick", "the right stick")


@dataclass(frozen=True)
class Rest:
    """What a second of rest has shown."""

    l2: float
    """The highest raw travel."""
    r2: float
    left: tuple[Stick, float]
    """Where the stick stood in the mean, and how far from there it was at most."""
    right: tuple[Stick, float]


class RestMeasurement:
    """Waits for a second of rest; whatever moves begins it anew."""

    def __init__(self) -> None:
        self.result: Rest | None = None
        self.progress = 0.0
        """How much of the second has passed, 0 to 1."""
        self._since_s = 0.0
        self._reports: list[tuple[float, ...]] = []
        self._low: tuple[float, ...] = ()
        self._high: tuple[float, ...] = ()

    def feed(self, state: ControllerState, now_s: float) -> str | None:
        """Take one report; what is being moved, if anything is."""
        values = (state.l2, state.r2, *state.left_stick, *state.right_stick)
        if self._reports:
            self._low = tuple(map(min, self._low, values))
            self._high = tuple(map(max, self._high, values))
            for name, low, high in zip(_CHANNELS, self._low, self._high, strict=True):
                if high - low > _STILL:
                    self._begin(values, now_s)
                    return f"{name} is being moved"
            self._reports.append(values)
        else:
            self._begin(values, now_s)
        self.progress = min((now_s - self._since_s) / REST_S, 1.0)
        if self.progress >= 1.0 and len(self._reports) >= _LEAST_REPORTS:
            self.result = self._measured()
        return None

    def _begin(self, values: tuple[float, ...], now_s: float) -> None:
        self._since_s, self._reports = now_s, [values]
        self._low = self._high = values
        self.progress = 0.0

    def _measured(self) -> Rest:
        l2, r2, *axes = zip(*self._reports, strict=True)
        sticks = []
        for xs, ys in ((axes[0], axes[1]), (axes[2], axes[3])):
            x, y = math.fsum(xs) / len(xs), math.fsum(ys) / len(ys)
            sticks.append(((x, y), max(math.hypot(one - x, other - y) for one, other in zip(xs, ys, strict=True))))
        return Rest(max(l2), max(r2), sticks[0], sticks[1])
