"""What follows when the field stops coming: nobody knows what is ahead, so that hands move nothing, and are told.

seeing ─▶ blind ─▶ waiting ─▶ seeing
       │        │          └ both triggers were seen released
       │        └ the field is back, or somebody else drives
       └ the field has expired
"""

from typing import Final

from common.status.codes import Sight
from operator_side.controller.feel import USUAL_LIGHT, WARNING_LIGHT, Color, Rumble

SIGNAL_S: Final = 3.0
"""The motors say it for so long; the light until the field is back."""
_PERIOD_S: Final = 1.0
_PULSES_S: Final = ((0.0, 0.12), (0.24, 0.36))
"""Two short pulses in each period, of both motors: nothing else moves both alike."""
_PULSE: Final = Rumble(left=0.7, right=0.7)


class Blindness:
    """Where we stand, by what happened last. A link that never was up is not blind: there is nothing to lose."""

    def __init__(self) -> None:
        self.sight = Sight.SEEING
        self.times = 0
        """How often the field was lost."""
        self.light: Color | None = None
        """What colour the controller has to show; None leaves its light alone, as long as it was never blind."""
        self._since_s = 0.0

    @property
    def holds(self) -> bool:
        """Whether the hands move nothing."""
        return self.sight is not Sight.SEEING

    def lose(self, now_s: float) -> None:
        """The field has expired while our hands drove."""
        if self.sight is not Sight.BLIND:
            self.sight, self._since_s, self.light = Sight.BLIND, now_s, WARNING_LIGHT
            self.times += 1

    def end(self) -> None:
        """The field is back, or somebody else drives: our hands still rest first."""
        if self.sight is Sight.BLIND:
            self.sight, self.light = Sight.WAITING, USUAL_LIGHT

    def see_hands(self, *, released: bool) -> None:
        """What the controller's state says of both triggers."""
        if released and self.sight is Sight.WAITING:
            self.sight = Sight.SEEING

    def rumble(self, now_s: float) -> Rumble:
        """What the motors do at `now_s` to say it."""
        since_s = now_s - self._since_s
        if self.sight is not Sight.BLIND or since_s >= SIGNAL_S:
            return Rumble()
        phase_s = since_s % _PERIOD_S
        return _PULSE if any(start_s <= phase_s < end_s for start_s, end_s in _PULSES_S) else Rumble()
