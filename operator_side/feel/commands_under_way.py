"""Displacement of the gripper by the commands under way, which the operator side knows and the robot side cannot.

A report is old: the arm follows commands that had not reached it then. The operator side integrates these commands
from the speed in the report. The result replaces ΔT = v t_d (eq. 8), which assumes a constant speed.
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
"""Loop age beyond which the robot side is disarmed, so that older commands do not matter."""
_MOST_COMMANDS: Final = 4096
"""Capacity of the history: eight times 250 commands a second over the window."""
_STEP_S: Final = 0.01
"""Step of a course, in seconds; trigger and sticks approach their mean command over the step."""
_LEAST_S: Final = 1e-9
_CLOCK_RATES_S: Final = 0.001
"""Largest excess of `held` by the two clocks' different rates."""


class Displacement(NamedTuple):
    """Effect of the commands under way, along the direction in which R2 advances."""

    displacement_m: float
    """δ, signed: from the gripper's place in the report to its place when a command sent now is followed."""
    speed_m_s: float
    """w, signed: its speed at that time."""


Sticks = tuple[float, float, float, float]
"""Deflections: across, right and up, and turning, right and up; -1 to 1 each"""
AT_REST: Final[Sticks] = (0.0, 0.0, 0.0, 0.0)


class Command(NamedTuple):
    """A command and the time of its stamp."""

    sent_s: float
    travel: float
    sticks: Sticks = AT_REST


class Report(NamedTuple):
    """Content of a robot side's message about the arm and our commands."""

    echo_sent_s: float | None
    """From the header: the stamp of the newest command that the robot side had received."""
    echo_held_s: float | None
    """From the header: the time for which the robot side had held that command."""
    speed_m_s: float
    """v along the direction in which R2 advances"""
    full_speed_m_s: float
    """v_max, speed of full travel"""
    told_m_s: float | None = None
    """Speed that the robot gives that command; None: as the command asks."""


class Course(NamedTuple):
    """Sampled course of the gripper by the commands under way."""

    displacements_m: FloatArray
    """(k,) displacement since the report, signed along the direction in which R2 advances"""
    speed_m_s: float
    """w: speed at the end, with the same sign"""
    aside_s: FloatArray
    """(k, 4) time that each stick, fully deflected, would take to the displacement that it has caused by then"""
    followed: FloatArray
    """(4,) deflections that the arm follows at the end"""
    changes_s: FloatArray
    """(n, 5) K: time of each joint to full travel of R2, and to each fully deflected stick"""

    def turned_back(self) -> "Course":
        """Return the course along the direction in which L2 retreats."""
        changes_s = self.changes_s * [-1.0, 1.0, 1.0, 1.0, 1.0]
        return self._replace(displacements_m=-self.displacements_m, speed_m_s=-self.speed_m_s, changes_s=changes_s)


class CommandsUnderWay:
    """History of our commands, integrated as the robot will follow them.

    Which commands are under way? The robot made its report at its time T. Its newest message from us bore our stamp
    `echo` and had been held for `held`, so it arrived at T - held. With the one-way delay d, echo + d = T - held:
    **a message that we sent at e = echo + held arrives at T.** No clocks are compared: e is our stamp and a duration.
    At T:

    - Commands up to `echo` have had their effect. The arm follows the one of `echo`; its measured speed v is as near
      to that command as the arm could get. Older ones are discarded, as the newest wins. The report also has the
      speed that the robot gives that command (`told`). It is zero if the command came too late or the arm was
      stopped, and less at a joint's limit.
    - Commands after `echo` are under way. On a steady link these were sent after e, and one sent at t is followed
      from T + (t - e) on. A command between `echo` and e may be overdue, as delays have grown: it arrives at T at
      the earliest. So e is no later than the first command after `echo`.

    A command sent now is followed from T + (now - e) on. Until then the arm goes from the speed v towards
    u(t) = x(t) v_max, x(t) the newest command sent at or before t, for t from e to now:

        δ = ∫ v dt,  w = v(now),  |dv/dt| <= a

    exactly, as u is constant between commands. Two errors remain: d varies from message to message, and an arm at the
    edge of its reach does not follow. `course` includes that joints share their acceleration. `feelahead bench error`
    measures the total.
    """

    def __init__(self, window_s: float = MAX_DELAY_S) -> None:
        """Keep the commands of the last `window_s`; ValueError unless finite and above 0."""
        if not (math.isfinite(window_s) and window_s > 0.0):
            raise ValueError(f"window_s = {window_s}; valid: a finite time above 0 s")
        self._window_s = window_s
        self._sent: deque[Command] = deque(maxlen=_MOST_COMMANDS)

    def __len__(self) -> int:
        """Return the number of commands in the history."""
        return len(self._sent)

    def sent(self, now_s: float, travel: float, sticks: Sticks = AT_REST) -> None:
        """Add a command sent at `now_s`, the stamp in its header: calibrated travel of R2 less that of L2, -1 to 1.

        It holds until the next one; add a travel of 0 when commands end. ValueError for a travel out of range, or a
        time that is not finite or before the last one.
        """
        if not -1.0 <= travel <= 1.0:
            raise ValueError(f"travel = {travel}; valid: -1 to 1")
        last_s = self._sent[-1].sent_s if self._sent else -math.inf
        if not (math.isfinite(now_s) and now_s >= last_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite time, not before the last command's, {last_s}")
        # The newest one before the window stays: it held when the window began.
        while len(self._sent) > 1 and self._sent[1].sent_s <= now_s - self._window_s:
            self._sent.popleft()
        self._sent.append(Command(now_s, travel, sticks))

    def sticks_at(self, now_s: float) -> Sticks:
        """Return the deflections last commanded at `now_s`."""
        return next((one.sticks for one in reversed(self._sent) if one.sent_s <= now_s), AT_REST)

    def displacement(self, now_s: float, report: Report, acceleration_m_s2: float) -> Displacement | None:
        """Compute δ and w at the time when a command sent at `now_s` is followed.

        acceleration_m_s2: a; infinite for an arm that follows at once. None if the commands since the echo are
        unknown: the echo is missing, impossible, or older than the window or the first command. ValueError for a
        speed or an acceleration out of range.
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
        """Follow trigger and sticks to the time at which a command sent at `now_s` is followed; see `displacement`.

        changes_s: K (n, 5). A change Δ of travel and deflections takes max |K Δ|, all in proportion. None also if the
        sticks rest throughout.
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
        """List the commands in force from e to now, oldest first, and the end; None if they are unknown."""
        echo_sent_s, held_s, speed_m_s, full_speed_m_s, told_m_s = report
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
        followed, *under_way = self._from(echo_sent_s, now_s)
        since_s = min(echo_sent_s + held_s, under_way[0].sent_s if under_way else now_s)
        travel = followed.travel if told_m_s is None else told_m_s / full_speed_m_s
        return [followed._replace(sent_s=since_s, travel=travel), *under_way, Command(now_s, 0.0)]

    def _from(self, since_s: float, until_s: float) -> list[Command]:
        """List the commands from the one in force at `since_s` to `until_s`, oldest first."""
        newest_first = []
        for one in reversed(self._sent):
            if one.sent_s <= until_s:
                newest_first.append(one)
            if one.sent_s <= since_s:
                break
        return newest_first[::-1]


def _edges_s(since_s: float, now_s: float) -> tuple[FloatArray, int]:
    """Sample the times from the map's look over `since_s` to `now_s`; also count the steps to `since_s`."""
    age_s = 0.5 * PERIOD_S
    before, after = math.ceil(age_s / _STEP_S), max(math.ceil((now_s - since_s) / _STEP_S), 1)
    looked, known = (
        np.linspace(a, b, n + 1) for a, b, n in ((since_s - age_s, since_s, before), (since_s, now_s, after))
    )
    return np.concatenate([looked, known[1:]]), before


def _means(commands: list[Command], edges_s: FloatArray) -> FloatArray:
    """Return the mean commanded travel and sticks (k - 1, 5) between edges (k,)."""
    sent_s = np.array([one.sent_s for one in commands])
    asked = np.array([(one.travel, *one.sticks) for one in commands])
    sums = np.concatenate([np.zeros((1, 5)), np.cumsum(np.diff(sent_s)[:, None] * asked[:-1], axis=0)])
    at = np.stack([np.interp(edges_s, sent_s, column) for column in sums.T], axis=1)
    lasts_s = np.maximum(np.diff(edges_s), _LEAST_S)
    means: FloatArray = np.diff(at, axis=0) / lasts_s[:, None]
    return means
