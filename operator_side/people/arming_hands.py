"""Hands that arm the robot, grip if asked to, and then act as a person says."""

from typing import Final, Literal

from common.errors import FeelaheadError
from common.files.plugged import fault_in_words
from common.protocol.messages import Telemetry, Vector2
from common.status.codes import Doing
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.button_map import BUTTON_OF, Action
from operator_side.hands.travel_calibration import StickRest
from operator_side.people.port import FingerInput, Person, Pulling, Seen

_REST_S = 1.2
"""Seconds of rest before arming; arming requires one second"""
_PRESS_S = 0.2
_PATIENCE_S = 3.0
"""Seconds without becoming armed after which the person rests and presses the arming button again"""
_GRIP_S = 0.3
"""Seconds for which an object is held before the person acts"""
_ASIDE_S: Final = 1.5
"""Seconds for which the sticks are deflected: full deflection then moves 150 mm across, or turns by 43°"""
_STICK: Final = StickRest()

Phase = Literal["rest", "arm", "grip", "act", "done"]
_DOING: Final[dict[Phase, Doing]] = {
    "rest": Doing.RESTING,
    "arm": Doing.ARMING,
    "grip": Doing.GRASPING,
    "act": Doing.PULLING,
    "done": Doing.DONE,
}


def constant_force(force_n: float, across: Vector2 = (0.0, 0.0), turning: Vector2 = (0.0, 0.0)) -> Person:
    """Make a person who pulls R2 with the constant force `force_n`, and deflects the sticks during the first 1.5 s.

    across, turning: deflections, -1 to 1. The sticks then rest, as a longer turn would leave the arm's workspace.
    """
    straight = FingerInput(r2_n=force_n)
    aside = FingerInput(r2_n=force_n, left_stick=_STICK.raw(across), right_stick=_STICK.raw(turning))
    return Pulling(lambda since_s: aside if since_s < _ASIDE_S else straight)


class ArmingHands:
    """Scripted person at a simulated controller who rests, arms the robot, grips if asked to, and acts as told."""

    def __init__(self, device: SimulatedDualSense, person: Person, *, grip: bool = False) -> None:
        """grip: close the gripper first, and act once it holds an object."""
        self.phase: Phase = "rest"
        self.began_s: float | None = None
        """Time at which the person began to act; None before"""
        self.person = person
        self._device = device
        self._grips = grip
        self._since_s: float | None = None
        self._holding_s: float | None = None

    @property
    def doing(self) -> Doing:
        """Present phase."""
        return _DOING[self.phase]

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Operate the controller at `now_s`."""
        if self._since_s is None or screen is None:
            self._since_s = now_s
        if screen is not None:
            self._choose_phase(now_s, now_s - self._since_s, screen)
        match self.phase:
            case "rest" | "done":
                self._hold(FingerInput())
            case "arm":
                self._hold(FingerInput(), Action.ARM if now_s - self._since_s < _PRESS_S else None)
            case "grip":
                self._hold(FingerInput(), Action.CLOSE_GRIPPER)
            case "act" if screen is not None:
                self._act(now_s, screen, delay_s)

    def _act(self, now_s: float, screen: Telemetry, delay_s: float) -> None:
        self.began_s = now_s if self.began_s is None else self.began_s
        device = self._device
        felt = device.travel, device.strength, device.rumble.left
        try:
            hands = self.person.act(Seen(now_s - self.began_s, screen, *felt, delay_s))
        except (Exception, SystemExit) as error:  # perhaps somebody else's code
            raise FeelaheadError(f"person {type(self.person).__name__}: {fault_in_words(error)}") from error
        if not isinstance(hands, FingerInput | None):
            raise FeelaheadError(
                f"person {type(self.person).__name__}: act returned {type(hands).__name__}; valid: a FingerInput, or"
                " None when the person has finished"
            )
        if hands is None:
            self._enter("done", now_s)
        self._hold(hands or FingerInput(), Action.CLOSE_GRIPPER if self._grips else None)

    def _choose_phase(self, now_s: float, for_s: float, screen: Telemetry) -> None:
        if self.phase == "rest" and for_s > _REST_S:
            self._enter("arm", now_s)
        elif self.phase == "arm" and screen.state == "armed":
            self._enter("grip" if self._grips else "act", now_s)
        elif self.phase == "arm" and for_s > _PATIENCE_S:
            self._enter("rest", now_s)
        elif self.phase == "grip":
            self._holding_s = (self._holding_s or now_s) if screen.holding else None
            if self._holding_s is not None and now_s - self._holding_s > _GRIP_S:
                self._enter("act", now_s)

    def _enter(self, phase: Phase, now_s: float) -> None:
        self.phase, self._since_s = phase, now_s

    def _hold(self, hands: FingerInput, action: Action | None = None) -> None:
        self._device.set_finger_force(hands.l2_n, hands.r2_n)
        self._device.set_sticks(left=hands.left_stick, right=hands.right_stick)
        pressed = {BUTTON_OF[Action.RUN]} | ({BUTTON_OF[action]} if action is not None else set())
        self._device.set_buttons(frozenset(pressed | hands.buttons))
