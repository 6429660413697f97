"""Perceptual deadband for stiffness and telemetry: a message leaves when the receiver's error would be felt or seen.

The deadband has a predictor (Hinterseer, Hirche, Chaudhuri, Steinbach and Buss 2008; IEEE 1918.1.1). The receiver keeps
the onset distances of the last message, and extrapolates the gripper's motion by its own commands and at most the
acceleration in that message (operator_side/feel/commands_under_way.py). The same model runs here, with the commands
that have arrived.
An error of a distance counts if it is above 1 mm and above 2 % of the distance: fingers stop an arm to a few
millimetres.

- A true distance that is longer than the receiver's makes triggers stiff too early. The message may wait until 10 ms
  after the last one: a controller cannot be written sooner.
- A true distance that is shorter makes triggers stiff too late. The message leaves at once, from a quarter of the
  deadband on. With the wire's resolution that is less than half a millimetre, the required repeatability of stops.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final

from common.following import follow
from common.periods import EARLY
from common.protocol.messages import MotionCommand, MotionState, Telemetry, TriggerField
from common.reaction import WRITE_S
from common.silence import KEEP_ALIVE_S
from robot_side.tick.sensed import Sensed

_DEADBAND_M: Final = 1e-3
_DEADBAND_SHARE: Final = 0.02
_NEARER: Final = 0.25
"""Share of the deadband above which a distance that became shorter is sent at once"""
_EIGHTHS: Final = 8.0


@dataclass
class _Belief:
    """What the receiver computes from the last message, by the commands that have arrived since."""

    sensed: Sensed
    sent_s: float
    state: tuple[MotionState, bool, bool]
    """State of motion, whether the held object stands, and whether the arm is hindered"""
    obeyed: int
    """Sequence number of the newest command when the message was sent"""
    commanded_m_s: float
    """The arm's commanded speed in the message"""
    target_m_s: float
    speed_m_s: float
    """Speed along R2 that the receiver assumes"""
    now_s: float
    """Time of the last update"""
    displacement_m: float = 0.0
    """Distance along R2 that the receiver assumes since the message"""
    later: deque[tuple[float, float]] = field(default_factory=deque)
    """Times and targets that the drives have not responded to yet"""

    def advance(self, now_s: float) -> None:
        """Carry the receiver's assumed motion to `now_s`."""
        while self.later and self.later[0][0] <= now_s:
            at_s, target_m_s = self.later.popleft()
            self._follow(max(at_s, self.now_s))
            self.target_m_s = target_m_s
        self._follow(now_s)

    def expect(self, target_m_s: float, at_s: float) -> None:
        """Follow a target from `at_s` on, which may be now."""
        if at_s <= self.now_s:
            self.target_m_s = target_m_s
        elif target_m_s != (self.later[-1][1] if self.later else self.target_m_s):
            self.later.append((at_s, target_m_s))

    def _follow(self, now_s: float) -> None:
        acceleration_m_s2, passed_s = self.sensed.r2.acceleration_m_s2, now_s - self.now_s
        moved = follow(self.displacement_m, self.speed_m_s, self.target_m_s, acceleration_m_s2, passed_s)
        (self.displacement_m, self.speed_m_s), self.now_s = moved, now_s


class StiffnessDeadband:
    """Deadband for the stiffness messages of one receiver, with what the receiver computes from the last message."""

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: send a stiffness message in every tick."""
        self._full_rate = full_rate
        self.response_s = 0.0
        """Time from a command's arrival until the arm follows it"""
        self.interval_s = 0.0
        """Minimum time between two stiffness messages, in s, set by the link's rate; a change of state never waits."""
        self._belief: _Belief | None = None

    def forget(self) -> None:
        """Begin with another receiver, to which nothing has been sent yet."""
        self._belief = None

    def due(
        self,
        sensed: Sensed,
        commanded_m_s: float,
        state: MotionState,
        stands: bool,
        hindered: bool,
        command: MotionCommand | None,
        now_s: float,
    ) -> bool:
        """Return whether a stiffness message leaves at `now_s`; if it does, it counts as received.

        commanded_m_s: commanded speed along R2's direction, from this tick on. command: the command from
        which that speed follows; None if nothing moves. stands, hindered: as in StiffnessUpdate.
        """
        obeyed, travel, by_operator = 0, 0.0, True
        if command is not None:
            obeyed, travel = command.header.sequence, command.r2 - command.l2
            by_operator = command.compensation == "operator"
        belief, states = self._belief, (state, stands, hindered)
        if belief is not None:
            early_s = EARLY * (now_s - belief.now_s)
            belief.advance(now_s)
            waits = by_operator, self.interval_s, now_s + early_s
            if not self._full_rate and not _matters(belief, sensed, states, *waits):
                # The receiver does not know yet how fast the arm follows a later command.
                later_m_s = travel * belief.sensed.r2.full_speed_m_s
                target_m_s = belief.commanded_m_s if obeyed == belief.obeyed else later_m_s
                belief.expect(target_m_s, now_s + self.response_s)
                return False
        before_m_s, later = commanded_m_s, deque[tuple[float, float]]()
        if self.response_s > 0.0:
            before_m_s = sensed.speed_m_s if belief is None else belief.target_m_s
            later = later if belief is None else belief.later
        self._belief = _Belief(sensed, now_s, states, obeyed, commanded_m_s, before_m_s, sensed.speed_m_s, now_s)
        self._belief.later = later
        self._belief.expect(commanded_m_s, now_s + self.response_s)
        return True


def _matters(
    belief: _Belief,
    sensed: Sensed,
    state: tuple[MotionState, bool, bool],
    by_operator: bool,
    interval_s: float,
    now_s: float,
) -> bool:
    """Return whether a message is due at `now_s`, which includes the tolerance of a deadline."""
    since_s, sent = now_s - belief.sent_s, belief.sensed
    if state != belief.state or since_s >= KEEP_ALIVE_S:
        return True
    if state[0] != "armed" or since_s < interval_s:  # not armed: triggers are released
        return False
    if sensed.rumble > sent.rumble:
        return True
    patient, shown = since_s < WRITE_S, sensed.rumble != sent.rumble
    for now, then, sign in ((sensed.r2, sent.r2, 1.0), (sensed.l2, sent.l2, -1.0)):
        # A receiver that does not compute δ adds δ of the message.
        moved_m = sign * belief.displacement_m if by_operator else then.displacement_m - now.displacement_m
        # The braking distance from a speed above the trigger's adds to δ: at most this.
        moved_m += _braking_m(sign * belief.speed_m_s, then.acceleration_m_s2)
        moved_m -= _braking_m(sign * sensed.speed_m_s, now.acceleration_m_s2)
        if _is_wrong(now, then, moved_m, sensed.horizon_m, patient):
            return True
        shown |= int(_EIGHTHS * now.course_stiffness) != int(_EIGHTHS * then.course_stiffness)
    return not patient and shown


def _braking_m(speed_m_s: float, acceleration_m_s2: float) -> float:
    return max(0.0, speed_m_s) ** 2 / (2.0 * acceleration_m_s2)


def _is_wrong(now: TriggerField, sent: TriggerField, moved_m: float, horizon_m: float, patient: bool) -> bool:
    """Compare the distances with the sent distances minus `moved_m`; return whether an error counts.

    patient: ignore distances that became longer. A distance at the horizon never counts as shorter: nothing is known
    beyond the horizon, and the last message still holds.
    """
    for onsets_m, before_m in ((now.fast_m, sent.fast_m), (now.slow_m, sent.slow_m)):
        for onset_m, was_m in zip(onsets_m, before_m, strict=True):
            apart_m = onset_m - was_m + moved_m
            if apart_m < -_NEARER * _DEADBAND_M:
                if apart_m < -_NEARER * _DEADBAND_SHARE * onset_m and onset_m < horizon_m:
                    return True
            elif apart_m > _DEADBAND_M and not patient and apart_m > _DEADBAND_SHARE * onset_m:
                return True
    return False


_SEEN_M: Final = 0.5e-3
"""Change that a viewer sees, in m or m/s"""
_SEEN_SHARE: Final = 0.01
_SEEN_PERIOD_S: Final = 0.02
_SEEN_AT_LEAST_S: Final = 0.1


class TelemetryDeadband:
    """Deadband for the telemetry to viewers; it keeps the last telemetry that left."""

    def __init__(self) -> None:
        self._sent: Telemetry | None = None
        self._words: tuple[Any, ...] = ()
        self._looked_s = self._sent_s = self._turned_s = -math.inf
        self._early_s = 0.0

    def may_be_due(self, words: tuple[Any, ...], now_s: float) -> bool:
        """Return whether to make a telemetry for `due`: when its texts and states change, else 50 times a second."""
        changed = words != self._words
        self._early_s, self._turned_s = EARLY * (now_s - self._turned_s), now_s
        if not changed and now_s - self._looked_s + self._early_s < _SEEN_PERIOD_S:
            return False
        if changed:
            self._sent = None
        self._words, self._looked_s = words, now_s
        return True

    def due(self, view: Telemetry, now_s: float) -> bool:
        """Return whether a telemetry leaves: its change is visible, or the last one left 0.1 s ago."""
        sent = self._sent
        if sent is not None and now_s - self._sent_s + self._early_s < _SEEN_AT_LEAST_S and _alike(view, sent):
            return False
        self._sent, self._sent_s = view, now_s
        return True


def _alike(view: Telemetry, sent: Telemetry) -> bool:
    pairs = zip(_lengths(view), _lengths(sent), strict=False)
    return all(abs(now - was) <= _SEEN_M for now, was in pairs) and all(
        abs(now - was) <= _SEEN_SHARE for now, was in zip(_shares(view), _shares(sent), strict=True)
    )


def _lengths(view: Telemetry) -> tuple[float, ...]:
    return (
        *(view.tool_speed_m_s, view.gripper_opening_m, view.enlargement_m),
        *view.tool_position_m,
        *(view.target_in_tool_m or ()),
    )


def _shares(view: Telemetry) -> tuple[float, ...]:
    course = view.l2_course_stiffness, view.r2_course_stiffness
    return *course, view.undone, *view.up_in_tool, view.base_turn_rad, view.camera_turn_rad
