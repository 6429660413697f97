"""The moment at which a stiffness leaves, and a telemetry: the receiver would be wrong by more than is felt, or seen.

This is a perceptual deadband with a predictor (Hinterseer, Hirche, Chaudhuri, Steinbach and Buss 2008; IEEE 1918.1.1).
The receiver holds the ways of the last message and moves the gripper on from there. It does so by its own commands, at
most at the acceleration in that message (operator_side/feel/commands_under_way.py). The same model runs here, by the
commands that have arrived.

A way counts as wrong by more than 1 mm, or 2 % of it: fingers stop an arm to a few millimetres.
- A way that is longer than the receiver believes makes triggers stiff too early. It may wait for 10 ms after the last
  message: a controller can be written no sooner.
- A way that is shorter makes them stiff too late. It leaves at once, from a quarter of the deadband on. With the wire's
  own step that is less than half a millimetre, to which stops are asked to be equal.
"""

import math
from typing import Any, Final

from common.following import follow
from common.protocol.messages import Compensation, MotionCommand, MotionState, Telemetry, TriggerField
from common.reaction import WRITE_S
from common.silence import KEEP_ALIVE_S
from robot_side.laws.law import Sensed

_DEADBAND_M: Final = 1e-3
_DEADBAND_SHARE: Final = 0.02
_NEARER: Final = 0.25
"""Share of the deadband from which on something nearer leaves at once."""
_HALF_A_TICK_S: Final = 0.5e-3
"""The tick that is nearest to a deadline counts."""
_EIGHTHS: Final = 8.0


class StiffnessDeadband:
    """The belief of one receiver, from message to message."""

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: a stiffness leaves in every tick."""
        self._full_rate = full_rate
        self.interval_s = 0.0
        """At least this lies between two that leave, where the link carries no more; a change of state never waits."""
        self.forget()

    def forget(self) -> None:
        """Another receiver, which knows nothing yet."""
        self._sent: Sensed | None = None
        self._state: MotionState = "disarmed"
        self._sent_s = self._now_s = -math.inf
        self._way_m = self._speed_m_s = self._target_m_s = self._told_m_s = 0.0
        self._obeyed = 0

    def due(
        self, sensed: Sensed, told_m_s: float, state: MotionState, command: MotionCommand | None, now_s: float
    ) -> bool:
        """Decide if this leaves at `now_s`; then the receiver is taken to know it.

        told_m_s: the speed that the arm is commanded from this tick on, along the direction in which R2 advances, by
        `command`; None: nothing moves.
        """
        sent = self._sent
        if sent is not None:
            self._way_m, self._speed_m_s = follow(
                self._way_m, self._speed_m_s, self._target_m_s, sent.r2.acceleration_m_s2, now_s - self._now_s
            )
        self._now_s = now_s
        obeyed = 0 if command is None else command.header.sequence
        compensation: Compensation = "operator" if command is None else command.compensation
        if sent is not None and not self._full_rate and not self._matters(sent, sensed, state, compensation):
            # The receiver does not know yet how fast a later command lets the arm go.
            travel = 0.0 if command is None else command.r2 - command.l2
            self._target_m_s = self._told_m_s if obeyed == self._obeyed else travel * sent.r2.full_speed_m_s
            return False
        self._sent, self._state, self._sent_s, self._obeyed = sensed, state, now_s, obeyed
        self._way_m, self._speed_m_s, self._told_m_s, self._target_m_s = 0.0, sensed.speed_m_s, told_m_s, told_m_s
        return True

    def _matters(self, sent: Sensed, sensed: Sensed, state: MotionState, compensation: Compensation) -> bool:
        since_s = self._now_s - self._sent_s + _HALF_A_TICK_S
        if state != self._state or since_s >= KEEP_ALIVE_S:
            return True
        if state != "armed" or since_s < self.interval_s:  # not armed: triggers are released
            return False
        if sensed.rumble > sent.rumble:
            return True
        if compensation == "operator":
            back_m, forth_m = -self._way_m, self._way_m
        else:
            # The receiver adds δ of the message, and reckons no further.
            back_m = sent.l2.displacement_m - sensed.l2.displacement_m
            forth_m = sent.r2.displacement_m - sensed.r2.displacement_m
        # The way to brake from a speed above the trigger's comes on top of δ: at most this.
        back_m += _braking_m(-self._speed_m_s, sent.l2) - _braking_m(-sensed.speed_m_s, sensed.l2)
        forth_m += _braking_m(self._speed_m_s, sent.r2) - _braking_m(sensed.speed_m_s, sensed.r2)
        patient, horizon_m = since_s < WRITE_S, sensed.horizon_m
        if _wrong(sensed.l2, sent.l2, back_m, horizon_m, patient) or _wrong(
            sensed.r2, sent.r2, forth_m, horizon_m, patient
        ):
            return True
        return not patient and _shown(sensed) != _shown(sent)


def _braking_m(speed_m_s: float, along: TriggerField) -> float:
    return float(max(0.0, speed_m_s) ** 2 / (2.0 * along.acceleration_m_s2))


def _wrong(now: TriggerField, sent: TriggerField, moved_m: float, horizon_m: float, patient: bool) -> bool:
    """Compare the ways with those that were sent, less `moved_m`; `patient`: none that is farther counts.

    A way at the horizon is no nearer: nothing is known from there on, and the last message still holds.
    """
    for ways, before in ((now.fast_m, sent.fast_m), (now.slow_m, sent.slow_m)):
        for way, was in zip(ways, before, strict=True):
            apart_m = way - was + moved_m
            if apart_m < -_NEARER * _DEADBAND_M:
                if apart_m < -_NEARER * _DEADBAND_SHARE * way and way < horizon_m:
                    return True
            elif apart_m > _DEADBAND_M and not patient and apart_m > _DEADBAND_SHARE * way:
                return True
    return False


def _shown(sensed: Sensed) -> tuple[int, int, float]:
    """Both strengths in eighths, and the rumble."""
    return int(_EIGHTHS * sensed.l2.stiffness), int(_EIGHTHS * sensed.r2.stiffness), sensed.rumble


_SEEN_M: Final = 0.5e-3
"""Metres, and metres a second."""
_SEEN_SHARE: Final = 0.01
_SEEN_PERIOD_S: Final = 0.02
_SEEN_AT_LEAST_S: Final = 0.1


class TelemetryDeadband:
    """The last view of those who look."""

    def __init__(self) -> None:
        self._sent: Telemetry | None = None
        self._words: tuple[Any, ...] = ()
        self._looked_s = self._sent_s = -math.inf

    def may_be_due(self, words: tuple[Any, ...], now_s: float) -> bool:
        """Whether to make a telemetry, to be asked of `due`: where the words in it differ, and 50 times a second."""
        changed = words != self._words
        if not changed and now_s - self._looked_s + _HALF_A_TICK_S < _SEEN_PERIOD_S:
            return False
        if changed:
            self._sent = None
        self._words, self._looked_s = words, now_s
        return True

    def due(self, view: Telemetry, now_s: float) -> bool:
        """Whether it is to leave: it differs by what can be seen, or the last one left 0.1 s ago."""
        sent = self._sent
        if sent is not None and now_s - self._sent_s + _HALF_A_TICK_S < _SEEN_AT_LEAST_S and _alike(view, sent):
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
    return view.l2, view.r2, *view.up_in_tool
