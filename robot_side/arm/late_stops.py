"""Whether the arm stops later than its limits say: by how much, for the law to allow for until it is told."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.commanded import LEVER_M
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState

_FROM_RAD_S: Final = 0.1
"""Least fall of a velocity that is judged; it counts at `LEVER_M` where a joint slides, as the next"""
_LEAST_RAD: Final = 0.004
_LEAST_S: Final = 0.025
"""Way and time by which a joint is late at least; simulated drives are 5 to 15 ms behind their reference"""
_LOST_S: Final = 0.1
"""Time between two states, in s, after which nothing is judged"""
_MOST_S: Final = 1.0
"""Most time, in s, for which a joint may go on after its velocity should have fallen"""
_REACHED: Final = 0.8
_SETTLED: Final = 0.05
_TREMBLES: Final = 0.1
_COMMANDS: Final = 512


@dataclass
class _Fall:
    """Fall of the expected velocities, from their greatest."""

    began_s: float
    position: FloatArray
    expected: FloatArray
    """(n,) velocities from which they fall"""
    measured: FloatArray
    way: FloatArray
    """(n,) expected way since then"""
    beyond: FloatArray
    """(n,) most by which the measured way was longer"""
    lowest: float = math.inf
    """Least of the greatest expected velocities since then"""


class LateStops:
    """Judge of how the arm slows down, by commands and measured positions.

    Expected is an arm that follows each command `response_s` after it arrived, with the limits' acceleration, all
    joints in proportion. While its velocities fall, its way is compared with the measured way. An arm that is late by τ
    goes farther by τ times the fall.
    """

    def __init__(
        self,
        limits: JointLimits,
        names: Sequence[str],
        sigma_rad: float = 0.0,
        turns_rad: FloatArray | float = math.inf,
    ) -> None:
        """names (n,): the joints'. sigma_rad: standard deviation of a reading.

        turns_rad: (n,) angles after which readings may repeat; infinite where they do not.
        """
        count = limits.velocity_rad_s.size
        self.later_s = 0.0
        """Most time by which the arm was late, in s; it never falls during a run"""
        self._notes: list[str] = []
        self._limits, self._names, self._falls = limits, names, 0
        self._turns_rad = np.broadcast_to(turns_rad, (count,))
        scale = np.where(limits.slides, LEVER_M, 1.0)
        self._from, self._least = _FROM_RAD_S * scale, _LEAST_RAD * scale + 6.0 * sigma_rad
        self._commands: deque[tuple[float, FloatArray]] = deque(maxlen=_COMMANDS)
        self._expected: FloatArray = np.zeros(count)
        self._position: FloatArray = np.zeros(count)
        self._time_s = -math.inf
        self._fall: _Fall | None = None

    def update(self, command: FloatArray, state: ArmState, late_s: float) -> None:
        """Take the newest state, and the velocities (n,) commanded in the tick before.

        late_s: the state's lateness, which commands have on their way, too.
        """
        time_s = state.time_s if state.simulated_s is None else state.simulated_s
        self._commands.append((time_s, command))
        passed_s = time_s - self._time_s
        if passed_s == 0.0:
            return
        self._time_s, before_rad = time_s, self._position
        self._position = state.joint_positions_rad
        if not 0.0 < passed_s < _LOST_S:
            self._expected, self._fall = np.zeros_like(self._expected), None
            return
        before = self._expected
        change = self._in_force(time_s - self._limits.response_s - late_s) - before
        most = self._limits.acceleration_rad_s2 * passed_s
        now = self._expected = before + change * min(1.0, float((most / np.maximum(np.abs(change), 1e-12)).min()))
        rises = float(np.abs(now).max()) - float(np.abs(before).max())
        measured, fall = np.abs(state.joint_velocities_rad_s), self._fall
        if fall is None:
            if rises >= 0.0 or not (np.abs(before) > self._from).any():
                return
            zeros = np.zeros_like(before)
            fall = self._fall = _Fall(time_s - passed_s, before_rad, before, measured, zeros, zeros)
        fall.way = fall.way + 0.5 * passed_s * (before + now)
        moved = self._position - fall.position
        wraps = np.isfinite(self._turns_rad)
        moved[wraps] -= self._turns_rad[wraps] * np.rint((moved - fall.way)[wraps] / self._turns_rad[wraps])
        beyond = np.sign(fall.expected) * (moved - fall.way)
        fall.beyond = np.maximum(fall.beyond, beyond)
        settled = (measured <= np.abs(now) + _SETTLED * np.maximum(np.abs(fall.expected), self._from)).all()
        judged = self._judge(fall, before)
        # A hand trembles: what rises by less than a tenth still falls.
        fall.lowest = min(fall.lowest, float(np.abs(now).max()))
        risen = float(np.abs(now).max()) > fall.lowest + _TREMBLES * float(np.abs(fall.expected).max())
        if risen or (rises >= 0.0 and settled) or time_s - fall.began_s > 2.0 * _MOST_S:
            self._falls, self._fall = self._falls + judged, None

    def restart(self) -> None:
        """Begin anew at the next state, which may be anywhere; what was found stays."""
        self._time_s = -math.inf

    def take_notes(self) -> list[str]:
        """Return a line for each time since the last call that the arm was later than before."""
        notes, self._notes = self._notes, []
        return notes

    def summary(self) -> dict[str, Any]:
        """Return the number of judged falls, and how many milliseconds later than said the latest was."""
        return {"judged": self._falls, "later_ms": round(1e3 * self.later_s, 1)}

    def _in_force(self, at_s: float) -> FloatArray:
        """Return the command in force at `at_s`."""
        while len(self._commands) > 1 and self._commands[1][0] <= at_s:
            self._commands.popleft()
        return self._commands[0][1]

    def _judge(self, fall: _Fall, ends: FloatArray) -> bool:
        """Judge a fall to the velocities `ends`; return whether it is long enough. It may still go on."""
        speed = np.abs(fall.expected)
        fell = speed - np.sign(fall.expected) * ends
        judged = (fell > np.maximum(self._from, 0.5 * speed)) & (fall.measured > _REACHED * speed)
        late_s = np.where(judged & (fall.beyond > self._least), fall.beyond / np.maximum(fell, 1e-9), 0.0)
        worst = int(late_s.argmax())
        later_s = min(float(late_s[worst]), _MOST_S)
        if later_s < max(_LEAST_S, 1.05 * self.later_s):
            return bool(judged.any())
        self.later_s = later_s
        self._notes.append(
            f"{self._names[worst]} slowed down {1e3 * later_s:.0f} ms later than [arm.limits] say,"
            f" from {speed[worst]:.2f} rad/s: the triggers allow for it from now on"
        )
        return True
