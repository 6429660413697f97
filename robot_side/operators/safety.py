"""Decision which command may move the arm, and until when.

There are two limits. *Gap*: time since the last accepted command. Within this limit the last command holds. Beyond it
the robot side disarms, and the arm itself decelerates from its measured state, because `valid_until` was not renewed.
*Age*: delay of a command beyond the link's own minimum. A command above this limit is discarded; a steady delay,
however long, adds no age.
"""

from collections import deque
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from msgspec import Meta

from common.limits import check_limits
from common.protocol.link_end import Arrival
from common.protocol.messages import MotionCommand, MotionState
from common.protocol.session import NOT_ARMED, Session, SessionEvent, SessionState

RELEASED_TRAVEL = 0.02
"""Largest travel or deflection, 0 to 1, that counts as at rest: a calibrated trigger or stick at rest reads 0, apart
from a count or so"""
_REMEMBERED_STOPS = 1000

_Limit = Annotated[float, Meta(gt=0.0, lt=60.0)]
_Allowance = Annotated[float, Meta(ge=0.0, lt=60.0)]
_Fresh = Annotated[float, Meta(gt=0.0, lt=1.0)]
"""Limit below the silence after which another driver may take over (`driver_session.TAKEN_OVER_S`)"""


@dataclass(frozen=True)
class SafetySettings:
    """Limits of the safety checks, all in seconds. None can be switched off: 0 is refused, or means no allowance."""

    gap_s: _Limit = 0.1
    """Time without an accepted command after which the arm stops."""
    age_s: _Limit = 0.1
    """A command is discarded if its queueing age is above this value plus jitter_s."""
    jitter_s: _Allowance = 0.08
    """Jitter of the link itself, not of a queue: by default eight times the 10 ms of the reference link."""
    max_delay_s: _Limit = 2.0
    """Loop age above which the arm is disarmed."""
    healthy_s: _Allowance = 1.0
    """Time for which commands must have arrived, with all inputs at rest, before the arm can be armed."""
    arm_s: _Fresh = 0.1
    """Age of the arm's newest state above which the arm is lost."""
    lease_s: _Limit = 0.9
    """Silence after which an operator loses the lease; the default keeps this within a second, a tick included."""

    def __post_init__(self) -> None:
        check_limits(self)
        if not self.gap_s < self.lease_s:
            raise ValueError(f"lease_s = {self.lease_s}; valid: above gap_s = {self.gap_s} to below 60")


class Permission(NamedTuple):
    """Command that may reach the arm in this tick, if any."""

    state: MotionState
    command: MotionCommand | None
    """Command to follow; None: stand still"""
    valid_until_s: float


class Safety:
    """Guard of the arm against broken, old or unintended commands; only commands of the lease's owner are given to it.

    An emergency stop is latched: it stays when its operator leaves, until somebody arms again.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self.stops: deque[tuple[float, str]] = deque(maxlen=_REMEMBERED_STOPS)
        """(time, reason) of each transition out of armed, and of each emergency stop"""
        self.discarded_by_age = 0
        self.settings = settings
        self._stopped = False
        self._stop_followed = (-1, -1)
        """Epoch and sequence number of the newest emergency stop that was obeyed"""
        self._session: Session | None = None
        self._arm_lost = self._arm_astray = False
        self._forget()

    def _forget(self) -> None:
        self._command: MotionCommand | None = None
        self._accepted_s: float | None = None
        self._echoed_s: float | None = None
        self._healthy_since_s: float | None = None
        self._arm_was_down = True

    @property
    def state(self) -> MotionState:
        """State of the robot, whoever owns the lease."""
        if self._session is not None and self._session.state is SessionState.ARMED:
            return "armed"
        return "stopped" if self._stopped else "disarmed"

    @property
    def still_because(self) -> str | None:
        """Why the arm stopped, or was not armed when this was asked for; None while it is armed, or before both"""
        if self.state == "armed":
            return None
        if self._session is not None and self._session.why.startswith(NOT_ARMED):
            return self._session.why
        return self.stops[-1][1] if self.stops else None

    @property
    def command(self) -> MotionCommand | None:
        """Newest accepted command, whether it moves the arm or not; None beyond the gap limit."""
        return self._command

    def begin(self, session: Session) -> None:
        """Begin with another owner; forget the last owner's commands."""
        self._forget()
        self._session = session
        if self._stopped:
            session.handle(SessionEvent.EMERGENCY_STOP)

    def end(self, event: SessionEvent, now_s: float) -> None:
        """End with the present owner, who leaves by `event`."""
        self._handle(event, now_s)
        self._forget()
        self._session = None

    def receive(self, command: MotionCommand, arrival: Arrival, now_s: float) -> bool:
        """Judge one command of the owner; return True if it is accepted. An emergency stop is obeyed, however late."""
        self.hear_stop(command, now_s)
        if not arrival.fresh:
            return False
        if self._queued_too_long(arrival):
            self.discarded_by_age += 1
            return False
        self.check(now_s)
        self._command, self._accepted_s = command, now_s
        if arrival.loop_age_s is not None:
            self._echoed_s = now_s - arrival.loop_age_s
        self._check_loop(now_s)
        self._follow_buttons(command, now_s)
        return True

    def hear_stop(self, command: MotionCommand, now_s: float) -> None:
        """Stop if `command` is an emergency stop, however late; each stop is obeyed only once.

        A late copy of the same stop, over another connection, must not undo an arming since.
        """
        order = command.header.epoch, command.header.sequence
        followed = self._stop_followed
        if command.emergency_stop and not (order[0] == followed[0] and order[1] <= followed[1]):
            self._stop_followed = order
            self.emergency_stop(now_s)

    def emergency_stop(self, now_s: float) -> None:
        """Stop the arm, in any state but stopped."""
        if self._session is not None and self._session.state is not SessionState.STOPPED:
            self._handle(SessionEvent.EMERGENCY_STOP, now_s)

    def permission(self, now_s: float) -> Permission:
        """Return the command that may move the arm in this tick, if any."""
        self.check(now_s)
        state = self.state
        if state != "armed" or self._command is None or self._accepted_s is None or not self._command.run:
            return Permission(state, None, now_s)
        return Permission(state, self._command, self._accepted_s + self.settings.gap_s)

    def arm_measured(self, age_s: float, now_s: float) -> None:
        """Stop the arm if its newest state is too old (age_s); to be called in every tick."""
        self._arm_lost = age_s > self.settings.arm_s
        if self._arm_lost:
            self._handle(SessionEvent.ARM_LOST, now_s, f"arm lost: its newest state is {1e3 * age_s:.0f} ms old")

    def arm_followed(self, stop: str | None, now_s: float) -> None:
        """Stop the arm if it does not do what it is told, or its states are doubted; to be called in every tick.

        stop: why, in words; None if it follows.
        """
        self._arm_astray = stop is not None
        if stop is not None:
            self._handle(SessionEvent.ASTRAY, now_s, stop)

    def arm_stopped(self, why: str | None, now_s: float) -> None:
        """Stop the arm as an emergency stop does, while its own controller lets nothing move; in every tick.

        why: in words; None if it is ready. Nobody can arm until it is, and then has to.
        """
        if why is None:
            return
        self._arm_astray = True
        self._stopped = True
        if self._session is not None and self._session.state is not SessionState.STOPPED:
            self._handle(SessionEvent.EMERGENCY_STOP, now_s, why)

    def arm_loaded(self, over: str | None, now_s: float) -> None:
        """Stop an armed arm whose load is over its limit; it may be armed again.

        over: which load, in words; None if none is.
        """
        if over is not None:
            self._handle(SessionEvent.ASTRAY, now_s, over)

    def check(self, now_s: float) -> None:
        """Stop the arm if the gap or the loop age is beyond its limit."""
        self._check_gap(now_s)
        self._check_loop(now_s)

    def _queued_too_long(self, arrival: Arrival) -> bool:
        return arrival.queueing_age_s > self.settings.age_s + self.settings.jitter_s

    def _check_gap(self, now_s: float) -> None:
        if self._accepted_s is not None and now_s - self._accepted_s > self.settings.gap_s:
            self._handle(SessionEvent.GAP, now_s, f"no command for {1e3 * (now_s - self._accepted_s):.0f} ms")
            self._command = self._accepted_s = None

    def _check_loop(self, now_s: float) -> None:
        if not self._loop_is_young(now_s):
            age = "an unknown time" if self._echoed_s is None else f"{now_s - self._echoed_s:.2f} s"
            self._handle(SessionEvent.OLD_LOOP, now_s, f"the link's round trip takes {age}")

    def _loop_is_young(self, now_s: float) -> bool:
        # Without an echo the loop age is unknown: conservatively, too old.
        return self._echoed_s is not None and now_s - self._echoed_s <= self.settings.max_delay_s

    def _follow_buttons(self, command: MotionCommand, now_s: float) -> None:
        pressed = command.arm and not self._arm_was_down
        self._arm_was_down = command.arm
        if self.state == "armed":
            return
        held = _held(command)
        if held is not None:
            self._handle(SessionEvent.INPUT_HELD, now_s)
        elif not self._loop_is_young(now_s) or self._arm_lost or self._arm_astray:
            return  # their own reasons are told
        else:
            if self._healthy_since_s is None:
                self._healthy_since_s = now_s
            if self._healthy_for_long(now_s):
                self._handle(SessionEvent.HEALTHY, now_s)
        if pressed:
            self._handle(SessionEvent.ARM, now_s)
            why = held or f"keep all inputs at rest for {self.settings.healthy_s:g} s, then press again"
            self._handle(SessionEvent.ARM_EARLY, now_s, f"{NOT_ARMED}: {why}")

    def _healthy_for_long(self, now_s: float) -> bool:
        return self._healthy_since_s is not None and now_s - self._healthy_since_s >= self.settings.healthy_s

    def _handle(self, event: SessionEvent, now_s: float, why: str | None = None) -> None:
        """Apply an event to the session's state table; most events restart the time `healthy_s`."""
        if event not in (SessionEvent.HEALTHY, SessionEvent.ARM, SessionEvent.ARM_EARLY):
            self._healthy_since_s = None
        if event is SessionEvent.EMERGENCY_STOP:
            self._stopped = True
        said = None if event is SessionEvent.ARM_LOST else why  # its age, which grows, would be news in each turn
        row = None if self._session is None else self._session.handle(event, said)
        if row is None:
            return
        if row.after is SessionState.ARMED:
            self._stopped = False
        elif row.before is SessionState.ARMED or event is SessionEvent.EMERGENCY_STOP:
            self.stops.append((now_s, why or row.why))


def _held(command: MotionCommand) -> str | None:
    """Return which input keeps the arm from being armed, in words; None if all are at rest."""
    if max(command.l2, command.r2) > RELEASED_TRAVEL:
        return "a trigger is pulled"
    if max(map(abs, (*command.lateral, *command.turning))) > RELEASED_TRAVEL:
        return "a stick is deflected"
    if command.gripper != 0.0:
        return "a gripper button is held"
    if command.home > 0.0:
        return "home is held"
    return "the emergency stop is held" if command.emergency_stop else None
