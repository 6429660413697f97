"""When the operator's motion may reach the arm: armed on purpose, disarmed by anything unusual.

disarmed ── arming button pressed, after a healthy second with released triggers ──▶ armed
armed ── the stream broke off, the loop grew too old, or a new epoch began ──▶ disarmed
any ── emergency stop ──▶ stopped ── arming button, as from disarmed ──▶ armed
"""

from common.messages import MotionState


class Arming:
    """The state machine; `now_s` is monotonic and comes with every call."""

    def __init__(self, healthy_s: float = 1.0) -> None:
        self.state: MotionState = "disarmed"
        self.stops: list[tuple[float, str]] = []
        """(when, why) of each transition out of `armed`, and of each emergency stop."""
        self._required_s = healthy_s
        self._healthy_since_s: float | None = None
        self._arm_was_down = True

    def disarm(self, now_s: float, reason: str) -> None:
        """Back to disarmed; the healthy second begins anew."""
        if self.state == "armed":
            self.stops.append((now_s, reason))
            self.state = "disarmed"
        self._healthy_since_s = None

    def emergency_stop(self, now_s: float) -> None:
        """Stop whatever goes on, until armed again."""
        if self.state != "stopped":
            self.stops.append((now_s, "emergency stop"))
        self.state = "stopped"
        self._healthy_since_s = None

    def command(self, now_s: float, *, triggers_released: bool, arm_down: bool) -> None:
        """Take note of one fresh command; the arming button's way down arms when all else is fulfilled."""
        pressed = arm_down and not self._arm_was_down
        self._arm_was_down = arm_down
        if self.state == "armed":
            return
        if not triggers_released:
            self._healthy_since_s = None
            return
        if self._healthy_since_s is None:
            self._healthy_since_s = now_s
        if pressed and now_s - self._healthy_since_s >= self._required_s:
            self.state = "armed"
