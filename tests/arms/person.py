"""Person who moves the tool down and up without end, well above what is below it: --person-file."""

from operator_side.people.port import FingerInput, Seen

LOW_M, HIGH_M = 0.3, 0.45
"""Heights of the tool at which the person turns back, in m"""
FORCE_N = 2.0


class Pacing:
    def __init__(self) -> None:
        self._down = True

    def act(self, seen: Seen) -> FingerInput:
        height_m = seen.screen.tool_position_m[2]
        self._down = height_m > (LOW_M if self._down else HIGH_M)
        return FingerInput(r2_n=FORCE_N) if self._down else FingerInput(l2_n=FORCE_N)


person = Pacing
