"""Where the gripper will be once the command sent now takes effect: what the operator side knows and the robot cannot.

A report of the robot is old, and the arm follows commands that had not reached it then. The operator side has sent
them: from the speed in the report it reckons on. That takes the place of ΔT = v t_d (eq. 8), which assumes that the
speed stays as it was.
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
"""Beyond this loop age the robot side is disarmed, so that no older command matters."""
_MOST_COMMANDS: Final = 4096
"""Kept at most: eight times what 250 commands a second leave in the window."""
_STEP_S: Final = 0.01
"""One step of a course, in which trigger and sticks go towards the mean of what was commanded."""
_LEAST_S: Final = 1e-9
_CLOCK_RATES_S: Final = 0.001
"""By so much two clocks that run at slightly different rates may make `held` too long."""


class Displacement(NamedTuple):
    """What the commands under way will have done, along the direction in which R2 advances."""

    way_m: float
    """δ, signed: from where the gripper was in the report to where it is when a command sent now is followed."""
    speed_m_s: float
    """w, signed: its speed then."""


Sticks = tuple[float, float, float, float]
"""Deflections: across, right and up, and turning, right and up; -1 to 1 each"""
AT_REST: Final[Sticks] = (0.0, 0.0, 0.0, 0.0)


class Command(NamedTuple):
    """What was sent, and when."""

    sent_s: float
    travel: float
    sticks: Sticks = AT_REST


class Report(NamedTuple):
    """What a message of the robot side says of the arm and of our commands."""

    echo_sent_s: float | None
    """From the header: the stamp of the newest command that the robot side had"""
    echo_held_s: float | None
    """and how long that had lain there."""
    speed_m_s: float
    """v along the direction in which R2 advances"""
    full_speed_m_s: float
    """v_max, of full travel"""
    told_m_s: float | None = None
    """The speed that the robot gives that command; None: what the command asked for."""


class Course(NamedTuple):
    """The gripper's way by the commands under way, point by point."""

    ways_m: FloatArray
    """(k,) signed, along the direction in which R2 advances, from where the gripper was in the report"""
    speed_m_s: float
    """w: the speed at the end, so signed"""
    aside_s: FloatArray
    """(k, 4) how long each stick, fully deflected, would take to where it has led by then"""
    followed: FloatArray
    """(4,) deflections that the arm follows at the end"""
    changes_s: FloatArray
    """(n, 5) K: how long each joint takes to full travel of R2, and to each fully deflected stick"""

    def turned_back(self) -> "Course":
        """The same along the direction in which L2 retreats."""
        changes_s = self.changes_s * [-1.0, 1.0, 1.0, 1.0, 1.0]
        return self._replace(ways_m=-self.ways_m, speed_m_s=-self.speed_m_s, changes_s=changes_s)


class CommandsUnderWay:
    """The operator side's own commands of the last seconds, followed as the robot will follow them.

    Which are still under way? The robot made its report at its time T. The newest message that it had by then was
    stamped `echo` by us and had lain there for `held`, so it arrived at T - held. If a message takes d to the robot,
    echo + d = T - held: **T is when a message arrives that we sent at e = echo + held.** No clocks are compared: e is
    a stamp of ours and a duration. At T:

    - Commands sent until `echo` have had their effect: the arm follows that of `echo`, and its speed v, measured at T,
      is as far on the way to it as the arm could get. Older ones cannot arrive any more, as the newest wins. What the
      arm makes of it the report says, too (`told`): nothing if it came too late or the arm was stopped, less where a
      joint is at its limit.
    - All that were sent after `echo` are under way. On a steady link these are the commands sent after e, and one sent
      at t is followed from T + (t - e) on. Where one sent between `echo` and e should have arrived and has not,
      messages take longer than that of `echo` did, and the first of these arrives at T at the earliest. So e is no
      later than the first command after `echo`.

    A command sent now is followed from T + (now - e) on. Until then the arm goes from the speed v towards
    u(t) = x(t) v_max, x(t) the newest command sent at or before t, for t from e to now:

        δ = ∫ v dt,  w = v(now),  |dv/dt| <= a

    exactly, as u is constant between commands. What differs in truth: d changes from message to message, and an
    arm at the edge of its reach does not do what it is told. That joints share out their acceleration `course` knows.
    `feelahead bench error` measures the sum of it.
    """

    def __init__(self, window_s: float = MAX_DELAY_S) -> None:
        """Remember what was sent in the last `window_s`; ValueError unless that is finite and above 0."""
        if not (math.isfinite(window_s) and window_s > 0.0):
            raise ValueError(f"window_s = {window_s}; valid: a finite time above 0 s")
        self._window_s = window_s
        self._sent: deque[Command] = deque(maxlen=_MOST_COMMANDS)

    def __len__(self) -> int:
        """How many commands are remembered."""
        return len(self._sent)

    def sent(self, now_s: float, travel: float, sticks: Sticks = AT_REST) -> None:
        """A command left at `now_s`, the stamp in its header: calibrated travel of R2 less that of L2, -1 to 1.

        It counts until the next one; who stops commanding says so by a travel of 0. ValueError for a travel out of
        range, or a time that is not finite or lies before the last one.
        """
        if not -1.0 <= travel <= 1.0:
            raise ValueError(f"travel = {travel}; valid: -1 to 1")
        last_s = self._sent[-1].sent_s if self._sent else -math.inf
        if not (math.isfinite(now_s) and now_s >= last_s):
            raise ValueError(f"now_s = {now_s}; valid: a finite time, not before the last command's, {last_s}")
        # The newest one from before the window stays: it is what counted as the window began.
        while len(self._sent) > 1 and self._sent[1].sent_s <= now_s - self._window_s:
            self._sent.popleft()
        self._sent.append(Command(now_s, travel, sticks))

    def sticks_at(self, now_s: float) -> Sticks:
        """Find how they were commanded last at `now_s`."""
        return next((one.sticks for one in reversed(self._sent) if one.sent_s <= now_s), AT_REST)

    def displacement(self, now_s: float, report: Report, acceleration_m_s2: float) -> Displacement | None:
        """δ and w by the time that a command sent at `now_s` is followed.

        acceleration_m_s2: a; infinite for an arm that follows at once. None where the commands since the echo are not
        known: without an echo, or with one that is older than the window or the first command, or that says what cannot
        be. ValueError for a speed or an acceleration that is none.
        """
        if not acceleration_m_s2 > 0.0:
            raise ValueError(f"acceleration_m_s2 = {acceleration_m_s2}; valid: above 0")
        counting = self._counting(now_s, report)
        if counting is None:
            return None
        way_m, speed = 0.0, report.speed_m_s
        for one, following in pairwise(counting):
            target, lasts_s = one.travel * report.full_speed_m_s, following.sent_s - one.sent_s
            way_m, speed = follow(way_m, speed, target, acceleration_m_s2, lasts_s)
        return Displacement(way_m, speed)

    def course(self, now_s: float, report: Report, changes_s: FloatArray) -> Course | None:
        """Follow trigger and sticks to the time at which a command sent at `now_s` is followed; see `displacement`.

        changes_s: K (n, 5). A change Δ of travel and deflections takes max |K Δ|, and all change in proportion. None
        where the sticks rest all the time, too.
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
        ways_m = full_speed_m_s * (points[:, 0] - points[0, 0])
        return Course(ways_m, full_speed_m_s * float(followed[0]), points[:, 1:], followed[1:], changes_s)

    def _counting(self, now_s: float, report: Report) -> list[Command] | None:
        """List the commands that count from e to now, the oldest first, and the end; None where they are not known."""
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
        """List the commands from the one that counts at `since_s` on, the oldest first."""
        newest_first = []
        for one in reversed(self._sent):
            if one.sent_s <= until_s:
                newest_first.append(one)
            if one.sent_s <= since_s:
                break
        return newest_first[::-1]


def _edges_s(since_s: float, now_s: float) -> tuple[FloatArray, int]:
    """Lay out times from when the map was looked at to `since_s` and on to `now_s`, and count those before that."""
    age_s = 0.5 * PERIOD_S
    before, after = math.ceil(age_s / _STEP_S), max(math.ceil((now_s - since_s) / _STEP_S), 1)
    looked, known = (
        np.linspace(a, b, n + 1) for a, b, n in ((since_s - age_s, since_s, before), (since_s, now_s, after))
    )
    return np.concatenate([looked, known[1:]]), before


def _means(commands: list[Command], edges_s: FloatArray) -> FloatArray:
    """Average travel and sticks (k - 1, 5), as commanded, between edges (k,)."""
    sent_s = np.array([one.sent_s for one in commands])
    asked = np.array([(one.travel, *one.sticks) for one in commands])
    sums = np.concatenate([np.zeros((1, 5)), np.cumsum(np.diff(sent_s)[:, None] * asked[:-1], axis=0)])
    at = np.stack([np.interp(edges_s, sent_s, column) for column in sums.T], axis=1)
    lasts_s = np.maximum(np.diff(edges_s), _LEAST_S)
    means: FloatArray = np.diff(at, axis=0) / lasts_s[:, None]
    return means
