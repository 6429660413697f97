"""Person who pulls R2 with 2 N while the arm is armed, and else lets go, resets and arms again, until it works."""

from operator_side.hands.button_map import BUTTON_OF, Action
from operator_side.people.port import FingerInput, Seen

_PERIOD_S, _PRESS_S = 1.6, 0.2


class Patient:
    """Person as described."""

    def act(self, seen: Seen) -> FingerInput:
        """Pull, or press reset and then the arming button, once in a while."""
        if seen.screen.state == "armed":
            return FingerInput(r2_n=2.0)
        phase_s = seen.since_s % _PERIOD_S
        if phase_s < _PRESS_S:
            return FingerInput(buttons=frozenset({BUTTON_OF[Action.ARM]}))
        if _PERIOD_S / 2.0 < phase_s < _PERIOD_S / 2.0 + _PRESS_S:
            return FingerInput(buttons=frozenset({BUTTON_OF[Action.RESET]}))
        return FingerInput()


person = Patient()
