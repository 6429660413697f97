"""Whether the arm stops later than its limits say: by how much, for the law to allow for until it is told."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.commanded import LEVER_M
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState

_FROM_RAD_S: Final = 0.1
"""Least velocity from which a stop is judged; it counts at `LEVER_M` where a joint slides, as the next"""
_LEAST_RAD: Final = 0.004
_LEAST_S: Final = 0.025
"""Way and time by which a stop is late at least; simulated drives are 5 to 15 ms behind their reference"""
_LOST_S: Final = 0.1
"""Time between two states, in s, after which a stop is not judged"""
_MOST_S: Final = 1.0
_FASTER: Final = 3.0
"""Greatest ratio of the velocities to which and from which a late stop is carried over"""
_REACHED: Final = 0.8
_STANDS: Final = 0.05
_COMMANDS: Final = 512


class LateStops:
    """Judge of the arm's stops, by commands and measured positions.

    Expected is an arm that follows each command `response_s` after it arrived, with the limits' acceleration, all
    joints in proportion. When a command ends, its way until it stands is compared with the measured way.
    """

    def __init__(self, limits: JointLimits, names: Sequence[str], sigma_rad: float = 0.0) -> None:
        """names (n,): the joints'. sigma_rad: standard deviation of a reading."""
        count = limits.velocity_rad_s.size
        self.later_s = 0.0
        """Time by which the arm stops later from its full speed, in s; it never falls during a run"""
        self._notes: list[str] = []
        self._limits, self._names, self._stops = limits, names, 0
        scale = np.where(limits.slides, LEVER_M, 1.0)
        self._from, self._least = _FROM_RAD_S * scale, _LEAST_RAD * scale + 6.0 * sigma_rad
        self._commands: deque[tuple[float, FloatArray]] = deque(maxlen=_COMMANDS)
        self._expected: FloatArray = np.zeros(count)
        self._time_s = -math.inf
        self._began: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._way: FloatArray = np.zeros(count)

    def update(self, command: FloatArray, state: ArmState, late_s: float) -> None:
        """Take the newest state, and the velocities (n,) commanded in the tick before.

        late_s: the state's lateness, which commands have on their way, too.
        """
        time_s = state.time_s if state.simulated_s is None else state.simulated_s
        self._commands.append((time_s, command))
        passed_s = time_s - self._time_s
        if passed_s == 0.0:
            return
        self._time_s = time_s
        measured = np.abs(state.joint_velocities_rad_s)
        if not 0.0 < passed_s < _LOST_S:
            self._expected, self._began = np.zeros_like(self._expected), None
            return
        before = self._expected
        target = self._in_force(time_s - self._limits.response_s - late_s)
        change, most = target - before, self._limits.acceleration_rad_s2 * passed_s
        share = min(1.0, float((most / np.maximum(np.abs(change), 1e-12)).min()))
        self._expected = before + share * change
        if self._began is not None and target.any():
            if not before.any():  # it should stand by now: it is late by at least what it has moved beyond
                self._judge(state.joint_positions_rad, *self._began)
            self._began = None
        if self._began is None and not target.any() and (np.abs(before) > self._from).any():
            self._began, self._way = (state.joint_positions_rad, before, measured), np.zeros_like(before)
        if self._began is None:
            return
        self._way = self._way + 0.5 * passed_s * (before + self._expected)
        if not self._expected.any() and (measured <= _STANDS * np.maximum(np.abs(self._began[1]), self._from)).all():
            self._judge(state.joint_positions_rad, *self._began)
            self._began = None

    def take_notes(self) -> list[str]:
        """Return a line for each stop since the last call that was later than any before."""
        notes, self._notes = self._notes, []
        return notes

    def summary(self) -> dict[str, Any]:
        """Return the number of judged stops, and how many milliseconds later than said the latest is."""
        return {"stops": self._stops, "later_ms": round(1e3 * self.later_s, 1)}

    def _in_force(self, at_s: float) -> FloatArray:
        """Return the command in force at `at_s`."""
        while len(self._commands) > 1 and self._commands[1][0] <= at_s:
            self._commands.popleft()
        return self._commands[0][1]

    def _judge(self, position: FloatArray, began: FloatArray, speed: FloatArray, measured: FloatArray) -> None:
        self._stops += 1
        moved = position - began
        beyond = np.sign(speed) * (moved - self._way)
        judged = (np.abs(speed) > self._from) & (measured > _REACHED * np.abs(speed)) & (beyond > self._least)
        late_s = np.where(judged, beyond / np.maximum(np.abs(speed), 1e-9), 0.0)
        worst = int(late_s.argmax())
        if late_s[worst] < _LEAST_S:
            return
        # A way that grows with the square of the speed takes longer from full speed: v / 2a.
        faster = min(float((self._limits.velocity_rad_s / np.maximum(np.abs(speed), 1e-9)).min()), _FASTER)
        later_s = min(faster * float(late_s[worst]), _MOST_S)
        if later_s > self.later_s:
            self.later_s = later_s
            self._notes.append(
                f"{self._names[worst]} stopped {1e3 * late_s[worst]:.0f} ms later than [arm.limits] say,"
                f" from {abs(speed[worst]):.2f} rad/s; the triggers allow for {1e3 * later_s:.0f} ms"
            )
