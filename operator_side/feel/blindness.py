"""Blindness after the loss of the field: the hands move nothing until it is back and both triggers were released.

seeing ─▶ blind ─▶ waiting ─▶ seeing
       │        │          └ both triggers were seen released
       │        └ the field is back, or somebody else drives
       └ the field has expired
"""

from typing import Final

from common.status.codes import Sight
from operator_side.controller.feel import USUAL_LIGHT, WARNING_LIGHT, Color, Rumble

SIGNAL_S: Final = 3.0
"""Duration of the motors' signal; the light stays until the field is back."""
_PERIOD_S: Final = 1.0
_PULSES_S: Final = ((0.0, 0.12), (0.24, 0.36))
"""Two short pulses of both motors in each period: no other signal drives both equally."""
_PULSE: Final = Rumble(left=0.7, right=0.7)


class Blindness:
    """State of sight. A link that never was up is not blind: there is nothing to lose."""

    def __init__(self) -> None:
        self.sight = Sight.SEEING
        self.times = 0
        """Number of losses of the field."""
        self.light: Color | None = None
        """Colour for the controller; None, before the first loss, leaves its light alone."""
        self._since_s = 0.0

    @property
    def holds(self) -> bool:
        """Whether the intent is held at zero."""
        return self.sight is not Sight.SEEING

    def lose(self, now_s: float) -> None:
        """Become blind: the field has expired while our hands drove."""
        if self.sight is not Sight.BLIND:
            self.sight, self._since_s, self.light = Sight.BLIND, now_s, WARNING_LIGHT
            self.times += 1

    def end(self) -> None:
        """End blindness, as the field is back or another operator drives; the hands must still rest first."""
        if self.sight is Sight.BLIND:
            self.sight, self.light = Sight.WAITING, USUAL_LIGHT

    def see_hands(self, *, released: bool) -> None:
        """Take in whether both triggers are released."""
        if released and self.sight is Sight.WAITING:
            self.sight = Sight.SEEING

    def rumble(self, now_s: float) -> Rumble:
        """Return the motors' signal at `now_s`."""
        since_s = now_s - self._since_s
        if self.sight is not Sight.BLIND or since_s >= SIGNAL_S:
            return Rumble()
        phase_s = since_s % _PERIOD_S
        return _PULSE if any(start_s <= phase_s < end_s for start_s, end_s in _PULSES_S) else Rumble()
