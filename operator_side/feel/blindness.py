"""Blindness: after a loss of stiffness messages the inputs move nothing until messages are back and triggers released.

seeing ─▶ blind ─▶ waiting ─▶ seeing
       │        │          └ both triggers have been released
       │        └ stiffness messages arrive again, or another operator drives
       └ the newest stiffness message has expired
"""

from typing import Final

from common.status.codes import Sight
from operator_side.controller.feel import USUAL_LIGHT, WARNING_LIGHT, Color, Rumble

SIGNAL_S: Final = 3.0
"""Seconds for which the motors signal blindness; the warning light stays until blindness ends."""
_PERIOD_S: Final = 1.0
_PULSES_S: Final = ((0.0, 0.12), (0.24, 0.36))
"""Begin and end of two short pulses of both motors in each period; no other signal drives both equally."""
_PULSE: Final = Rumble(left=0.7, right=0.7)


class Blindness:
    """State of blindness. It begins as seeing: a link that was never up had nothing to lose."""

    def __init__(self) -> None:
        self.sight = Sight.SEEING
        self.times = 0
        """Number of times that blindness began."""
        self.light: Color | None = None
        """Colour for the controller's light; None before the first loss, which leaves the light unchanged."""
        self._since_s = 0.0

    @property
    def holds(self) -> bool:
        """Whether the intent is held at zero."""
        return self.sight is not Sight.SEEING

    def lose(self, now_s: float) -> None:
        """Become blind, as stiffness messages expired while this operator drove."""
        if self.sight is not Sight.BLIND:
            self.sight, self._since_s, self.light = Sight.BLIND, now_s, WARNING_LIGHT
            self.times += 1

    def end(self) -> None:
        """End blindness, as messages are back or another operator drives; both triggers must still be released."""
        if self.sight is Sight.BLIND:
            self.sight, self.light = Sight.WAITING, USUAL_LIGHT

    def see_hands(self, *, released: bool) -> None:
        """See again if both triggers are released while waiting."""
        if released and self.sight is Sight.WAITING:
            self.sight = Sight.SEEING

    def rumble(self, now_s: float) -> Rumble:
        """Return the motors' signal at `now_s`."""
        since_s = now_s - self._since_s
        if self.sight is not Sight.BLIND or since_s >= SIGNAL_S:
            return Rumble()
        phase_s = since_s % _PERIOD_S
        return _PULSE if any(start_s <= phase_s < end_s for start_s, end_s in _PULSES_S) else Rumble()
