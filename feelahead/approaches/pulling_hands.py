"""A person who arms the robot and then pulls as told: no eyes for the scene, no will of their own."""

from typing import Literal

from common.protocol.messages import Telemetry
from feelahead.approaches.pulls import Hands, Pull
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.button_map import BUTTON_OF, Action

_REST_S = 1.2
"""The triggers rest for longer than the healthy second that arming asks for."""
_PRESS_S = 0.2
_PATIENCE_S = 3.0
"""After so long in vain they press again."""
_GRIP_S = 0.3
"""What is gripped is held for so long before the pull begins."""


Phase = Literal["rest", "arm", "grip", "pull"]


class PullingHands:
    """rest ─▶ arm ─▶ (grip ─▶) pull, on a simulated controller."""

    def __init__(self, device: SimulatedDualSense, pull: Pull, *, grip: bool = False) -> None:
        """`grip`: close the gripper first, and pull once it holds something."""
        self.phase: Phase = "rest"
        self.pull_began_s: float | None = None
        self.let_go_s: float | None = None
        """From then on nothing is pulled or deflected any more; None for never."""
        self._device = device
        self._pull = pull
        self._grips = grip
        self._since_s: float | None = None
        self._holding_s: float | None = None

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Act at `now_s` on what the screen says of arming and gripping; nothing else of it counts."""
        del delay_s
        if self._since_s is None or screen is None:
            self._since_s = now_s
        for_s = now_s - self._since_s
        if screen is not None:
            self._choose_phase(now_s, for_s, screen)
        match self.phase:
            case "rest":
                self._act(Hands())
            case "arm":
                self._act(Hands(), Action.ARM if now_s - self._since_s < _PRESS_S else None)
            case "grip":
                self._act(Hands(), Action.CLOSE_GRIPPER)
            case "pull":
                self._follow_pull(now_s)

    def _choose_phase(self, now_s: float, for_s: float, screen: Telemetry) -> None:
        if self.phase == "rest" and for_s > _REST_S:
            self._enter("arm", now_s)
        elif self.phase == "arm" and screen.state == "armed":
            self._enter("grip" if self._grips else "pull", now_s)
        elif self.phase == "arm" and for_s > _PATIENCE_S:
            self._enter("rest", now_s)
        elif self.phase == "grip":
            self._holding_s = (self._holding_s or now_s) if screen.holding else None
            if self._holding_s is not None and now_s - self._holding_s > _GRIP_S:
                self._enter("pull", now_s)

    def _enter(self, phase: Phase, now_s: float) -> None:
        self.phase, self._since_s = phase, now_s

    def _follow_pull(self, now_s: float) -> None:
        if self.pull_began_s is None:
            self.pull_began_s = now_s
        gone = self.let_go_s is not None and now_s >= self.let_go_s
        hands = Hands() if gone else self._pull(now_s - self.pull_began_s)
        self._act(hands, Action.CLOSE_GRIPPER if self._grips else None)

    def _act(self, hands: Hands, action: Action | None = None) -> None:
        self._device.set_finger_force(hands.l2_n, hands.r2_n)
        self._device.set_sticks(left=hands.left_stick, right=hands.right_stick)
        pressed = {BUTTON_OF[Action.RUN]} | ({BUTTON_OF[action]} if action is not None else set())
        self._device.set_buttons(frozenset(pressed))
