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
from typing import Any, Final, get_args

import numpy as np

from common.arrays import FloatArray
from common.following import follow
from common.protocol.messages import MotionCommand, MotionState, Telemetry
from common.reaction import WRITE_S
from common.silence import KEEP_ALIVE_S
from robot_side.compiled.kernel import BOOL, FLOAT64, INT64, compiled, inlined, input_array, output_array, record_array
from robot_side.tick.sensed import (
    ACCELERATION,
    DISPLACEMENT,
    FULL_SPEED,
    HORIZON,
    L2,
    NUMBERS,
    NUMBERS_PER_SIDE,
    R2,
    RUMBLE,
    SPEED,
    STIFFNESS,
    Sensed,
)

_DEADBAND_M: Final = 1e-3
_DEADBAND_SHARE: Final = 0.02
_NEARER: Final = 0.25
"""Share of the deadband above which a distance that became shorter is sent at once"""
_HALF_A_TICK_S: Final = 0.5e-3
"""Tolerance of a deadline, in seconds: half a tick, so that the nearest tick counts"""
_EIGHTHS: Final = 8.0
_STATES: Final[dict[MotionState, int]] = {state: number for number, state in enumerate(get_args(MotionState))}
_ARMED: Final = _STATES["armed"]
_STANDS: Final = len(_STATES)
_HINDERED: Final = 2 * _STANDS
_BELIEF: Final = np.dtype(
    [
        *((name, np.float64) for name in ("sent", "now", "displacement", "speed", "target", "commanded")),
        *((name, np.int64) for name in ("known", "state", "obeyed")),
    ]
)
"""What the receiver computes from the last message. sent, now: times of that message and of the last update, in s.
displacement, speed, target: motion along R2 by commands since that message, in m and m/s. commanded: the arm's
commanded speed in the message, in m/s. known: whether a message has been sent. state: number of the state of motion,
plus _STANDS if the held object stands, plus _HINDERED if the arm is hindered. obeyed: sequence number of the newest
command when the message was sent."""

_follow = inlined(follow)


class StiffnessDeadband:
    """Deadband for the stiffness messages of one receiver, with what the receiver computes from the last message."""

    def __init__(self, *, full_rate: bool = False) -> None:
        """full_rate: send a stiffness message in every tick."""
        self._full_rate = full_rate
        self.interval_s = 0.0
        """Minimum time between two stiffness messages, in s, set by the link's rate; a change of state never waits."""
        self._sent: FloatArray = np.zeros(NUMBERS)
        self.forget()

    def forget(self) -> None:
        """Begin with another receiver, to which nothing has been sent yet."""
        self._belief: np.ndarray = np.zeros(1, dtype=_BELIEF)

    def due(
        self,
        sensed: Sensed,
        told_m_s: float,
        state: MotionState,
        stands: bool,
        hindered: bool,
        command: MotionCommand | None,
        now_s: float,
    ) -> bool:
        """Return whether a stiffness message leaves at `now_s`; if it does, it counts as received.

        told_m_s: commanded speed from this tick on, in the direction in which R2 advances. command: the command from
        which that speed follows; None if nothing moves. stands, hindered: as in StiffnessUpdate.
        """
        obeyed, travel, by_operator = 0, 0.0, True
        if command is not None:
            obeyed, travel = command.header.sequence, command.r2 - command.l2
            by_operator = command.compensation == "operator"
        due: bool = _due(
            *(self._belief, self._sent, sensed.numbers, told_m_s),
            *(_STATES[state] + _STANDS * stands + _HINDERED * hindered, obeyed, travel, by_operator),
            *(self.interval_s, self._full_rate, now_s),
        )
        return due


@inlined
def _braking_m(speed: float, acceleration: float) -> float:
    return max(0.0, speed) * max(0.0, speed) / (2.0 * acceleration)


@inlined
def _wrong(numbers: FloatArray, sent: FloatArray, side: int, moved: float, patient: bool) -> bool:
    """Compare the distances with the sent distances minus `moved` (m); return whether an error counts.

    patient: ignore distances that became longer. A distance at the horizon never counts as shorter: nothing is known
    beyond the horizon, and the last message still holds.
    """
    for place in range(side * NUMBERS_PER_SIDE, side * NUMBERS_PER_SIDE + DISPLACEMENT):
        onset = numbers[place]
        apart = onset - sent[place] + moved
        if apart < -_NEARER * _DEADBAND_M:
            if apart < -_NEARER * _DEADBAND_SHARE * onset and onset < numbers[HORIZON]:
                return True
        elif apart > _DEADBAND_M and not patient and apart > _DEADBAND_SHARE * onset:
            return True
    return False


@inlined
def _matters(
    belief: Any, sent: FloatArray, numbers: FloatArray, state: int, by_operator: bool, interval: float, now: float
) -> bool:
    since = now - belief.sent + _HALF_A_TICK_S
    if state != belief.state or since >= KEEP_ALIVE_S:
        return True
    if state % _STANDS != _ARMED or since < interval:  # not armed: triggers are released
        return False
    if numbers[RUMBLE] > sent[RUMBLE]:
        return True
    patient, shown = since < WRITE_S, numbers[RUMBLE] != sent[RUMBLE]
    for side in (R2, L2):
        first, sign = side * NUMBERS_PER_SIDE, 1.0 if side == R2 else -1.0
        # A receiver that does not compute δ adds δ of the message.
        moved = (
            sign * belief.displacement if by_operator else sent[first + DISPLACEMENT] - numbers[first + DISPLACEMENT]
        )
        # The braking distance from a speed above the trigger's adds to δ: at most this.
        moved += _braking_m(sign * belief.speed, sent[first + ACCELERATION])
        moved -= _braking_m(sign * numbers[SPEED], numbers[first + ACCELERATION])
        if _wrong(numbers, sent, side, moved, patient):
            return True
        shown |= int(_EIGHTHS * numbers[first + STIFFNESS]) != int(_EIGHTHS * sent[first + STIFFNESS])
    return not patient and shown


@compiled(
    *(
        record_array(_BELIEF),
        output_array(1),
        input_array(1),
        FLOAT64,
        INT64,
        INT64,
        FLOAT64,
        BOOL,
        FLOAT64,
        BOOL,
        FLOAT64,
    ),
    returns=BOOL,
)
def _due(
    beliefs: np.ndarray,
    sent: FloatArray,
    numbers: FloatArray,
    commanded: float,
    state: int,
    obeyed: int,
    travel: float,
    by_operator: bool,
    interval: float,
    full_rate: bool,
    now: float,
) -> bool:
    """Return whether to send, and update what the receiver computes; `sent`, `numbers` (NUMBERS,): as in `Sensed`."""
    belief = beliefs[0]
    if belief.known == 1:
        acceleration = sent[R2 * NUMBERS_PER_SIDE + ACCELERATION]
        belief.displacement, belief.speed = _follow(
            belief.displacement, belief.speed, belief.target, acceleration, now - belief.now
        )
    belief.now = now
    if belief.known == 1 and not full_rate and not _matters(belief, sent, numbers, state, by_operator, interval, now):
        # The receiver does not know yet how fast the arm follows a later command.
        later = travel * sent[R2 * NUMBERS_PER_SIDE + FULL_SPEED]
        belief.target = belief.commanded if obeyed == belief.obeyed else later
        return False
    for i in range(sent.size):
        sent[i] = numbers[i]
    belief.known, belief.state, belief.sent, belief.obeyed = 1, state, now, obeyed
    belief.displacement, belief.speed, belief.commanded, belief.target = 0.0, numbers[SPEED], commanded, commanded
    return True


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
        self._looked_s = self._sent_s = -math.inf

    def may_be_due(self, words: tuple[Any, ...], now_s: float) -> bool:
        """Return whether to make a telemetry for `due`: when its texts and states change, else 50 times a second."""
        changed = words != self._words
        if not changed and now_s - self._looked_s + _HALF_A_TICK_S < _SEEN_PERIOD_S:
            return False
        if changed:
            self._sent = None
        self._words, self._looked_s = words, now_s
        return True

    def due(self, view: Telemetry, now_s: float) -> bool:
        """Return whether a telemetry leaves: its change is visible, or the last one left 0.1 s ago."""
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
    return view.l2, view.r2, view.undone, *view.up_in_tool, view.base_turn_rad, view.camera_turn_rad
