"""Which command may move the arm, and until when.

Two limits, not one. *Gap*: the time since the last accepted command; within it the last command holds, past
it the robot side disarms, and the arm itself decelerates from its measured state because nothing renewed
`valid_until`. *Age*: how much longer than the link's own minimum a command took; an old one is discarded,
while a steady delay, however long, ages nothing.
"""

from dataclasses import dataclass

from common.link_end import Arrival
from common.messages import MotionCommand, MotionState
from common.session import Arming

RELEASED_TRAVEL = 0.02
"""Travel below this counts as released: a calibrated trigger at rest reads 0, give or take a count."""


@dataclass(frozen=True)
class SafetySettings:
    """The limits; all in seconds."""

    gap_s: float = 0.1
    """Without an accepted command for this long the arm stops."""
    age_s: float = 0.1
    """A command that queued for longer than this plus `jitter_s` is discarded."""
    jitter_s: float = 0.08
    """The link's own spread that is not a queue: eight times the 10 ms of the reference link."""
    max_delay_s: float = 2.0
    """A loop age above this disarms."""
    healthy_s: float = 1.0
    """How long commands must have come, with released triggers, before arming."""

    def __post_init__(self) -> None:
        for name in ("gap_s", "age_s", "max_delay_s"):
            if not 0.0 < getattr(self, name) < 60.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: above 0 to below 60")
        for name in ("jitter_s", "healthy_s"):
            if not 0.0 <= getattr(self, name) < 60.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 0 to below 60")


@dataclass(frozen=True)
class Permission:
    """What may reach the arm in this tick."""

    state: MotionState
    command: MotionCommand | None
    """The command to follow; None means stand still."""
    valid_until_s: float


class Safety:
    """Guards the arm against a stream that is broken, old, or not meant."""

    def __init__(self, settings: SafetySettings) -> None:
        self.arming = Arming(settings.healthy_s)
        self.discarded_by_age = 0
        self._settings = settings
        self._command: MotionCommand | None = None
        self._accepted_s = 0.0

    def receive(self, command: MotionCommand, arrival: Arrival, now_s: float) -> bool:
        """Judge one command; True when it was accepted. An emergency stop counts however late it comes."""
        if command.emergency_stop:
            self.arming.emergency_stop(now_s)
        if not arrival.fresh:
            return False
        if arrival.queueing_age_s > self._settings.age_s + self._settings.jitter_s:
            self.discarded_by_age += 1
            return False
        self._check_gap(now_s)
        if arrival.loop_age_s is not None and arrival.loop_age_s > self._settings.max_delay_s:
            self.arming.disarm(now_s, f"loop age of {arrival.loop_age_s:.2f} s")
        self._command, self._accepted_s = command, now_s
        if not command.emergency_stop:
            released = command.l2 <= RELEASED_TRAVEL and command.r2 <= RELEASED_TRAVEL
            self.arming.command(now_s, triggers_released=released, arm_down=command.arm)
        return True

    def new_epoch(self, now_s: float) -> None:
        """The operator side restarted or another one took over: nothing of the old one counts any more."""
        self._command = None
        self.arming.disarm(now_s, "the operator side began a new epoch")

    def permission(self, now_s: float) -> Permission:
        """What may move in this tick."""
        self._check_gap(now_s)
        valid_until_s = self._accepted_s + self._settings.gap_s
        if self.arming.state != "armed" or self._command is None or not self._command.run:
            return Permission(self.arming.state, None, valid_until_s)
        return Permission(self.arming.state, self._command, valid_until_s)

    def _check_gap(self, now_s: float) -> None:
        gap_s = now_s - self._accepted_s
        if self._command is not None and gap_s > self._settings.gap_s:
            self.arming.disarm(now_s, f"no command for {gap_s * 1e3:.0f} ms")
            self._command = None
