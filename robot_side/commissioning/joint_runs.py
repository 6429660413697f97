"""Runs of one joint: velocity steps of rising speed, forth and back within a room, as commanded and as measured."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.commissioning.procedure import SLIDE_M_PER_RAD, Motion, Procedure, ProcedureError, Seen

FIRST_RAD_S: Final = 0.1
_FASTER: Final = 1.6
"""First speed, and the ratio of each speed to the one before"""
_HELD_S: Final = 0.8
"""Longest time for which a speed is commanded, in seconds"""
_NOISE_S: Final = 0.5
_STILL_S: Final = 0.2
_SETTLING_S: Final = 0.4
_NEVER_STILL_S: Final = 3.0
"""Times, in s: for the noise at rest; without motion, and since the last command, before a joint counts as at rest"""
_STILL_RAD: Final = 0.002
_USED: Final = 0.9
_WAYS: Final = 2.0
_WIDER: Final = 1.15
"""Share of the room that is used; ways in it of a stop, as starting takes another one; margin of the way of a stop"""
_REACHED: Final = 0.9
"""Share of the commanded speed from which on the next speed is tried"""
_SLOPE_S: Final = 0.04
_FOLLOWS: Final = 0.3
_STALLED_S: Final = 0.25
_NOT_BEGUN_S: Final = 0.6
_CRAWLS: Final = 0.2
"""Times without progress, in s, after which a joint is not driven on; share of the commanded speed that is progress"""
_OTHERS_RAD: Final = 0.03
_WRONG_WAY_RAD: Final = 0.01
_LEAST_RAD: Final = 0.1
"""Least room in which anything can be measured"""
_MARGIN_RAD: Final = 0.02
"""Distance from an end of the joint's range that is kept free"""


@dataclass
class Run:
    """One velocity step from rest to rest, and what was measured; metres instead of radians where the joint slides."""

    velocity_rad_s: float
    """Commanded, with its sign"""
    began_s: float
    ended_s: float = 0.0
    """Times at which the joint was commanded to move, and to stand"""
    times_s: list[float] = field(default_factory=list)
    positions_rad: list[float] = field(default_factory=list)
    """Times and positions of the measured states, from rest to rest"""

    @property
    def peak_rad_s(self) -> float:
        """Greatest speed in the commanded direction, over 40 ms or between two states."""
        times, ways = np.array(self.times_s), np.sign(self.velocity_rad_s) * np.array(self.positions_rad)
        later = np.searchsorted(times, times + _SLOPE_S)
        before = np.flatnonzero(later < times.size)
        after = later[before]
        return float(((ways[after] - ways[before]) / (times[after] - times[before])).max(initial=0.0))

    @property
    def stopping_rad(self) -> float:
        """Way from the command to stand until rest."""
        at_end = float(np.interp(self.ended_s, self.times_s, self.positions_rad))
        return abs(self.positions_rad[-1] - at_end)


@dataclass
class JointRuns:
    """All runs of one joint."""

    noise_rad: float
    """Standard deviation of the readings at rest"""
    period_s: float
    """Mean time between two states"""
    runs: list[Run]


class RunsOfJoint:
    """Procedure that drives one joint; the others are commanded to stand."""

    def __init__(self, joint: int, names: Sequence[str], limits: JointLimits, room_rad: float) -> None:
        """names (n,): the joints'. room_rad: way that the joint may move; `SLIDE_M_PER_RAD` of it where it slides."""
        self._joint, self._names, self._count = joint, names, limits.velocity_rad_s.size
        self._name = self._named(joint)
        self._scales = np.where(np.broadcast_to(limits.slides, self._count), SLIDE_M_PER_RAD, 1.0)
        self._scale = float(self._scales[joint])
        self._unit = "m" if self._scale < 1.0 else "rad"
        self._fastest = float(limits.velocity_rad_s[joint])
        self._ends = tuple(float(end[joint]) for end in limits.ends_rad)
        self._room = room_rad * self._scale
        self._begin: FloatArray = np.zeros(self._count)
        self._begun = False
        self._noise = 0.0
        self._run: Run | None = None
        self._last_s = -np.inf

        self.its_own_fault = False
        """Whether the joint, and not the state of the arm, ended the runs"""

    def __call__(self) -> Procedure[JointRuns]:
        """Measure; ProcedureError for a joint that does not follow, goes the wrong way, or has too little room."""
        noted = Run(0.0, 0.0)
        self._run = noted
        seen = yield from self._drive(0.0)
        self._begin, self._begun = seen.state.joint_positions_rad.copy(), True
        until_s = seen.now_s + _NOISE_S
        while seen.now_s < until_s:
            seen = yield from self._drive(0.0)
        self._noise = float(np.diff(noted.positions_rad).std() / np.sqrt(2.0)) if len(noted.times_s) > 2 else 0.0
        period_s = float(np.diff(noted.times_s).mean()) if len(noted.times_s) > 1 else _NOISE_S
        away, room = self._way(float(self._begin[self._joint]))
        runs: list[Run] = []
        speed = min(FIRST_RAD_S * self._scale, self._fastest)
        stopping, repeated = 0.3 * speed + 0.5 * speed * speed / self._scale, 0.0
        while _WAYS * stopping < _USED * room:
            seen = yield from self._back(seen)
            begin = float(self._begin[self._joint])
            before = len(runs)
            for sign, free in ((away, _USED * room), (-away, None)):
                left = abs(self._at(seen) - begin) if free is None else free
                if left > stopping:
                    seen, run = yield from self._step(seen, sign * speed, left, stopping)
                    runs.append(run)
            if len(runs) < before + 2:
                break
            peak = min(run.peak_rad_s for run in runs[-2:])
            if peak < _REACHED * speed and speed > repeated:  # a machine that paused spoils a run, but hardly two
                repeated = speed
                del runs[before:]
                continue
            if speed >= self._fastest or peak < _REACHED * speed:
                break
            faster = min(_FASTER * speed, self._fastest)
            stopping = _stopping(runs, faster)
            speed = faster
        yield from self._back(seen)
        return JointRuns(self._noise, period_s, runs)

    def _way(self, position: float) -> tuple[float, float]:
        """Return the direction of the first run, and the room in this direction."""
        lower, upper = self._ends
        below, above = (distance - _MARGIN_RAD * self._scale for distance in (position - lower, upper - position))
        away, room = (
            (1.0, min(above, self._room)) if above >= min(below, self._room) else (-1.0, min(below, self._room))
        )
        if room < _LEAST_RAD * self._scale:
            raise self._fault(
                f"{self._name} has {room:.3f} {self._unit} to the ends of its range, or of room;"
                f" valid: at least {_LEAST_RAD * self._scale:.3f} {self._unit}"
            )
        return away, room

    def _step(self, seen: Seen, velocity: float, free: float, stopping: float) -> Procedure[tuple[Seen, Run]]:
        """Command `velocity` until all of the way `free` but that for the stop is used, then stand until rest."""
        self._run = run = Run(velocity, seen.now_s)
        seen = yield from self._rest(seen)
        run.began_s = seen.now_s
        direction, start = float(np.sign(velocity)), self._at(seen)
        moved, farthest, progress_s = 0.0, 0.0, seen.now_s
        while moved + stopping < free and seen.now_s - run.began_s < _HELD_S:
            begun = moved > _WRONG_WAY_RAD * self._scale
            if moved < -(_WRONG_WAY_RAD * self._scale + 6.0 * self._noise):
                raise self._fault(f"{self._name} moves the other way than it is commanded")
            if moved > farthest + _CRAWLS * abs(velocity) * _STALLED_S + self._noise:
                farthest, progress_s = moved, seen.now_s
            if seen.now_s - progress_s > (_STALLED_S if begun else _NOT_BEGUN_S):
                raise self._fault(f"{self._name} does not follow, or met something, after {moved:.3f} {self._unit}")
            seen = yield from self._drive(velocity)
            moved = direction * (self._at(seen) - start)
        run.ended_s = seen.now_s
        seen = yield from self._rest(seen, run.ended_s)
        moved, asked = direction * (self._at(seen) - start), abs(velocity) * (run.ended_s - run.began_s)
        if moved < _FOLLOWS * asked - 6.0 * self._noise:
            raise self._fault(
                f"{self._name} does not follow, or met something: it moved by {moved:.3f} {self._unit}"
                f" when {asked:.3f} {self._unit} were commanded"
            )
        return seen, run

    def _back(self, seen: Seen) -> Procedure[Seen]:
        """Return slowly to where the joint was at the beginning, if it is far from there."""
        self._run = None
        begin, slow = float(self._begin[self._joint]), FIRST_RAD_S * self._scale
        limit_s = seen.now_s + _NEVER_STILL_S + abs(self._at(seen) - begin) / slow
        if abs(self._at(seen) - begin) > _LEAST_RAD * self._scale * 0.2:
            while abs(begin - self._at(seen)) > _STILL_RAD * self._scale + self._noise and seen.now_s < limit_s:
                seen = yield from self._drive(min(max(3.0 * (begin - self._at(seen)), -slow), slow))
        return (yield from self._rest(seen, seen.now_s))

    def _rest(self, seen: Seen, since_s: float = -np.inf) -> Procedure[Seen]:
        """Stand until the joint is at rest, and return the last state."""
        limit_s = seen.now_s + _NEVER_STILL_S
        near = _STILL_RAD * self._scale + 8.0 * self._noise
        there, still_s = self._at(seen), seen.now_s
        while seen.now_s - still_s < _STILL_S or seen.now_s - since_s < _SETTLING_S:
            seen = yield from self._drive(0.0)
            here = self._at(seen)
            if abs(here - there) > near:
                there, still_s = here, seen.now_s
            if seen.now_s > limit_s:
                raise self._fault(f"{self._name} does not come to rest within {_NEVER_STILL_S:g} s")
        return seen

    def _drive(self, velocity: float) -> Procedure[Seen]:
        """Command the joint once, and note the next state."""
        command = np.zeros(self._count)
        command[self._joint] = velocity
        seen = yield Motion(command)
        self._note(seen)
        apart = np.abs(seen.state.joint_positions_rad - self._begin)
        apart[self._joint] -= 1.2 * self._room
        worst = int((apart / self._scales).argmax())
        if self._begun and apart[worst] > _OTHERS_RAD * self._scales[worst]:
            what = "moves farther than its room" if worst == self._joint else f"moves while {self._name} is commanded"
            raise self._fault(f"{self._named(worst)} {what}")
        return seen

    def _fault(self, text: str) -> ProcedureError:
        self.its_own_fault = True
        return ProcedureError(text)

    def _at(self, seen: Seen) -> float:
        return float(seen.state.joint_positions_rad[self._joint])

    def _named(self, joint: int) -> str:
        return f"joint {joint + 1} ({self._names[joint][:40]})"

    def _note(self, seen: Seen) -> None:
        state = seen.state
        if self._run is not None and state.time_s > self._last_s:
            self._last_s = state.time_s
            self._run.times_s.append(state.time_s)
            self._run.positions_rad.append(float(state.joint_positions_rad[self._joint]))


def _stopping(runs: Sequence[Run], speed: float) -> float:
    """Return the way for a stop from `speed`, by the ways of stops from lower speeds, with a margin."""
    stops = [(min(run.peak_rad_s, abs(run.velocity_rad_s)), run.stopping_rad) for run in runs]
    before, last = (max(pair, key=lambda stop: stop[1]) for pair in (stops[:-2][-2:] or stops, stops[-2:]))
    square = last[1] / last[0] ** 2
    if before[0] < 0.8 * last[0]:  # latency makes a part that grows with the speed, braking one with its square
        square = min(max((last[1] / last[0] - before[1] / before[0]) / (last[0] - before[0]), 0.0), square)
    steady = last[1] / last[0] - square * last[0]
    return _WIDER * (steady * speed + square * speed * speed)
