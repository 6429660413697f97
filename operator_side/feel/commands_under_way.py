"""Displacement of the gripper by the commands under way: those that had not reached the robot side when it reported.

Only the operator side knows these commands. It integrates them, beginning with the speed in the robot side's report.
The result replaces ΔT = v t_d (eq. 8), which assumes a constant speed.
"""

import math
from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.following import follow, follow_together
from common.protocol.around import PERIOD_S

MAX_DELAY_S: Final = 2.0
"""Loop age, in seconds, beyond which the robot side disarms the arm, so that older commands do not matter"""
_MOST_COMMANDS: Final = 4096
"""Maximum number of commands in the history: eight times as many as 250 commands a second over MAX_DELAY_S"""
_STEP_S: Final = 0.01
"""Time step of a Course, in seconds; in each step, trigger and sticks follow the step's mean command"""
_LEAST_S: Final = 1e-9
_CLOCK_RATES_S: Final = 0.001
"""Largest time, in seconds, by which the reported `echo_held_s` may be too long, as the two clocks' rates differ"""


class Displacement(NamedTuple):
    """Motion of the gripper by the commands under way, along the direction in which R2 moves it."""

    displacement_m: float
    """δ, signed: from the gripper's position in the report to its position when a command sent now takes effect"""
    speed_m_s: float
    """w, signed: the gripper's speed when a command sent now takes effect"""


Sticks = tuple[float, float, float, float]
"""Deflections, -1 to 1 each: across to the right, across upwards, turning right, turning up"""
AT_REST: Final[Sticks] = (0.0, 0.0, 0.0, 0.0)


class Command(NamedTuple):
    """A command in the history."""

    sent_s: float
    """Stamp of the command's message"""
    travel: float
    """Calibrated travel of the advancing trigger less that of the other, -1 to 1"""
    sticks: Sticks = AT_REST


class Report(NamedTuple):
    """Content of a stiffness message about the arm and our commands, as of its sending."""

    echo_sent_s: float | None
    """Stamp of the newest command that the robot side had received; None before the first"""
    echo_held_s: float | None
    """Time since the robot side had received that command; None before the first"""
    speed_m_s: float
    """v: speed along the direction in which R2 moves the gripper"""
    full_speed_m_s: float
    """v_max: speed that full travel commands"""
    commanded_m_s: float | None = None
    """Speed that the robot side gives the newest command it had received, within its limits; None: as commanded"""
    response_s: float = 0.0
    """Time from a command's arrival at the robot side until the arm follows it"""


class Course(NamedTuple):
    """Course of the gripper by the commands under way, sampled at k times."""

    displacements_m: FloatArray
    """(k,) displacement since the report, along the direction in which R2 moves the gripper"""
    speed_m_s: float
    """w: speed at the end of the course, along the same direction"""
    aside_s: FloatArray
    """(k, 4) displacement by each stick's axis, as the time that full deflection of the axis would take for it"""
    followed: FloatArray
    """(4,) deflections that the arm follows at the end of the course"""
    changes_s: FloatArray
    """(n, 5) K: time that each joint takes to full travel of R2, and to full deflection of each stick's axis"""


class CommandsUnderWay:
    """History of our commands, and the motion of the arm as it will follow them.

    Which commands are under way? The robot side made its report at its time T. The newest message that it had from us
    had our stamp `echo` and had arrived at T - held. With the one-way delay d, echo + d = T - held:
    **a message that we sent at e = echo + held arrives at T.** No clocks are compared: e is our stamp plus a duration.
    At T:

    - The command stamped `echo` has replaced all older ones, and the arm follows it. The arm's measured speed v is as
      near to that command as the arm could get. The report also has the speed that the robot side gives the
      command (`commanded_m_s`): zero if the command came too late or the arm was stopped, less at a joint's limit.
    - Commands after `echo` are under way. On a steady link they were sent after e, and a command sent at t is followed
      from T + (t - e) on. A command sent between `echo` and e is overdue, as delays have grown: it arrives at T at
      the earliest. So e is taken no later than the first command after `echo`.

    A command sent now is followed from T + (now - e) on. Until then the arm's speed goes from v towards
    u(t) = x(t) v_max, for t from e to now. x(t) is the travel of the newest command sent at or before t:

        δ = ∫ v dt,  w = v(now),  |dv/dt| <= a

    Real drives respond later: the arm follows a command from `response_s` after its arrival on. Then v answers the
    commands that were sent before e - response_s, and δ counts from there.

    This is exact, as u is constant between commands. Two errors remain: d varies from message to message, and an arm
    at the edge of its workspace does not follow. `feelahead bench error` measures both together. `displacement` takes
    the trigger alone; `course` also follows the sticks, with all limited together by the joints' accelerations.
    """

    def __init__(self, window_s: float = MAX_DELAY_S) -> None:
        """Keep the commands of the last `window_s`; ValueError unless `window_s` is finite and above 0."""
        if not (math.isfinite(window_s) and window_s > 0.0):
            raise ValueError(f"window_s = {window_s}; valid: a finite time above 0 s")
        self._window_s = window_s
        self._sent: deque[Command] = deque(maxlen=_MOST_COMMANDS)

    def __len__(self) -> int:
        """Return the number of commands in the history."""
        return len(self._sent)

    def sent(self, now_s: float, travel: float, sticks: Sticks = AT_REST) -> None:
        """Add a command. now_s: stamp of its message. travel: calibrated travel of R2 less that of L2, -1 to 1.

        The command holds until the next one; add a travel of 0 when commands end. ValueError for a travel out of range,
        or a time that is not finite or before that of the last command.
        """
        if not -1.0 <= travel <= 1.0:
            raise ValueError(f"travel = {travel}; valid: -1 to 1")
        last_s = self._sent[-1].sent_s if self._sent else -math.inf
        if not (math.isfinite(now_s) and now_s >= last_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite time, {last_s} (that of the last command) or later")
        # The newest command before the window stays: it held when the window began.
        while len(self._sent) > 1 and self._sent[1].sent_s <= now_s - self._window_s:
            self._sent.popleft()
        self._sent.append(Command(now_s, travel, sticks))

    def sticks_at(self, now_s: float) -> Sticks:
        """Return the deflections of the newest command sent at or before `now_s`."""
        return next((one.sticks for one in reversed(self._sent) if one.sent_s <= now_s), AT_REST)

    def displacement(self, now_s: float, report: Report, acceleration_m_s2: float) -> Displacement | None:
        """Compute δ and w at the time when a command sent at `now_s` takes effect.

        acceleration_m_s2: a; infinite for an arm that reaches a commanded speed at once. None if the commands since
        the report's echo are unknown: the echo is missing, impossible, before the window, or before the first command.
        ValueError for a speed or an acceleration out of range.
        """
        if not acceleration_m_s2 > 0.0:
            raise ValueError(f"acceleration_m_s2 = {acceleration_m_s2}; valid: above 0")
        counting = self._counting(now_s, report)
        if counting is None:
            return None
        displacement_m, speed = 0.0, report.speed_m_s
        for one, following in pairwise(counting):
            target, lasts_s = one.travel * report.full_speed_m_s, following.sent_s - one.sent_s
            displacement_m, speed = follow(displacement_m, speed, target, acceleration_m_s2, lasts_s)
        return Displacement(displacement_m, speed)

    def course(self, now_s: float, report: Report, changes_s: FloatArray) -> Course | None:
        """Compute the course by trigger and sticks until a command sent at `now_s` takes effect.

        changes_s: K (n, 5) of Course. A change Δ of travel and deflections takes max |K Δ|, all in proportion.
        None if `displacement` is None, or if the sticks rest in all commands under way.
        """
        counting = self._counting(now_s, report)
        if counting is None or all(one.sticks == AT_REST for one in counting[:-1]):
            return None
        since_s, full_speed_m_s = counting[0].sent_s, report.full_speed_m_s
        edges_s, before = _edges_s(since_s, now_s)
        looked_s = float(edges_s[0])
        earlier = [one._replace(sent_s=max(one.sent_s, looked_s)) for one in self._from(looked_s, since_s)]
        targets = _means([*earlier, *counting], edges_s)
        followed, passed = targets[0], [np.zeros(5)]
        for number, (target, lasts_s) in enumerate(zip(targets, np.diff(edges_s).tolist(), strict=True)):
            if number == before:
                followed = np.array([report.speed_m_s / full_speed_m_s, *followed[1:]])
            gained, followed = follow_together(followed, target, changes_s, lasts_s)
            passed.append(passed[-1] + gained)
        points = np.array(passed[before:])
        displacements_m = full_speed_m_s * (points[:, 0] - points[0, 0])
        return Course(displacements_m, full_speed_m_s * float(followed[0]), points[:, 1:], followed[1:], changes_s)

    def _counting(self, now_s: float, report: Report) -> list[Command] | None:
        """List the commands in force from e to `now_s`, oldest first, then a last entry at `now_s`; None if unknown."""
        echo_sent_s, held_s, speed_m_s, full_speed_m_s, commanded_m_s, response_s = report
        if not math.isfinite(speed_m_s):
            raise ValueError(f"speed_m_s = {speed_m_s}; valid: finite")
        if not (math.isfinite(full_speed_m_s) and full_speed_m_s > 0.0):
            raise ValueError(f"full_speed_m_s = {full_speed_m_s}; valid: finite and above 0")
        if echo_sent_s is None or held_s is None:
            return None
        if not (self._sent and max(now_s - self._window_s, self._sent[0].sent_s) <= echo_sent_s <= now_s):
            return None
        if not 0.0 <= held_s <= now_s - echo_sent_s + _CLOCK_RATES_S:
            return None
        newest, *under_way = self._from(echo_sent_s, now_s)
        since_s = min(echo_sent_s + held_s, under_way[0].sent_s if under_way else now_s) - response_s
        travel = newest.travel if commanded_m_s is None else commanded_m_s / full_speed_m_s
        earlier = self._from(since_s, echo_sent_s)[:-1] if response_s > 0.0 else []
        followed = [one._replace(sent_s=max(one.sent_s, since_s)) for one in (*earlier, newest._replace(travel=travel))]
        return [*followed, *under_way, Command(now_s, 0.0)]

    def _from(self, since_s: float, until_s: float) -> list[Command]:
        """List the command in force at `since_s` and all later ones until `until_s`, oldest first."""
        newest_first = []
        for one in reversed(self._sent):
            if one.sent_s <= until_s:
                newest_first.append(one)
            if one.sent_s <= since_s:
                break
        return newest_first[::-1]


def _edges_s(since_s: float, now_s: float) -> tuple[FloatArray, int]:
    """Return times from the map's computation over `since_s` to `now_s`, and the number of steps before `since_s`."""
    age_s = 0.5 * PERIOD_S
    before, after = math.ceil(age_s / _STEP_S), max(math.ceil((now_s - since_s) / _STEP_S), 1)
    looked, known = (
        np.linspace(a, b, n + 1) for a, b, n in ((since_s - age_s, since_s, before), (since_s, now_s, after))
    )
    return np.concatenate([looked, known[1:]]), before


def _means(commands: list[Command], edges_s: FloatArray) -> FloatArray:
    """Return the mean commanded travel and sticks (k - 1, 5) between the times `edges_s` (k,)."""
    sent_s = np.array([one.sent_s for one in commands])
    asked = np.array([(one.travel, *one.sticks) for one in commands])
    sums = np.concatenate([np.zeros((1, 5)), np.cumsum(np.diff(sent_s)[:, None] * asked[:-1], axis=0)])
    at = np.stack([np.interp(edges_s, sent_s, column) for column in sums.T], axis=1)
    lasts_s = np.maximum(np.diff(edges_s), _LEAST_S)
    means: FloatArray = np.diff(at, axis=0) / lasts_s[:, None]
    return means
