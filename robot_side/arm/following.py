"""Whether the arm follows its commands: in words, as an error of the tool's motion, and as a reason to stop.

follows ─▶ noticed ─▶ stopped
              │          a joint has been still, or gone too far, for half a second; or astray for a quarter
              └ held: its load rises, and something perceived is near what it moves
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from common.arrays import BoolArray, FloatArray
from robot_side.arm.commanded import LEVER_M
from robot_side.arm.joint_tracking import CLOCK, TRACK, Fault, track
from robot_side.arm.late_stops import LateStops
from robot_side.arm.limits import JointLimits
from robot_side.arm.load_limit import LoadLimit
from robot_side.arm.port import ArmState, GripperPose

NOTICED_RAD: Final = 0.02
"""Way that a joint stays behind or goes beyond, from which it is noticed: more than real arms' dry friction holds back.
It counts at `LEVER_M` where a joint slides; six standard deviations of readings are added"""
STOPS_S: Final = {Fault.STILL: 0.5, Fault.FAR: 0.5, Fault.ASTRAY: 0.25}
"""Times, in s, after which faults stop the arm, once they were noticed"""
_PRESSING_S: Final = 2.0
"""Time, in s, after which a fault stops the arm though its drive presses on: on a brake, or on what is not perceived"""
_LIMITS_S: Final[FloatArray] = np.array([STOPS_S.get(fault, math.inf) for fault in Fault])
_ASKED_AGAIN_S: Final = 0.1
_NO_LOADS: Final[FloatArray] = np.empty(0)
_TURN_RAD: Final = 6.0
"""Range from which a joint may turn all round, so that its driver may wrap its readings; the ends have margins"""
_SAYS: Final = {
    Fault.ASTRAY: ("moves", "move", " otherwise than commanded"),
    Fault.FAR: ("moves", "move", " too far"),
    Fault.STILL: ("does", "do", " not move"),
    Fault.SLOW: ("moves", "move", " too slowly"),
}


class Following:
    """Judge of one arm's motion, by its commands and measured positions."""

    def __init__(self, limits: JointLimits, names: Sequence[str] = (), sigma_rad: float = 0.0) -> None:
        """names (n,): the joints'; without them their numbers are told. sigma_rad: standard deviation of a reading."""
        count = len(limits.velocity_rad_s)
        self.text: str | None = None
        """Words for the joints' worst fault; None if the arm follows"""
        self.stop: str | None = None
        """Why the arm must stop; None if it need not"""
        self.errors_rad_s: FloatArray | None = None
        """(n,) velocities beyond the expected ones, of joints that nothing in their way explains; None for no such"""
        self._limits, self._still = limits, np.zeros(count)
        self._names = [f"joint {j + 1}" + (f" ({names[j][:40]})" if j < len(names) else "") for j in range(count)]
        self._tracks, self._clock = np.zeros(count, TRACK), np.zeros(1, CLOCK)
        self._tracks["limit"] = NOTICED_RAD * np.where(limits.slides, LEVER_M, 1.0) + 6.0 * sigma_rad
        lower_rad, upper_rad = limits.ends_rad
        turns = ~np.array(limits.slides) & (upper_rad - lower_rad >= _TURN_RAD)
        self._tracks["turn"] = np.where(turns, 2.0 * math.pi, 0.0)
        self._known = np.zeros(count, dtype=np.int64)
        self._told, self._worst = np.zeros(count, dtype=bool), Fault.NONE
        self._noticed: Counter[str] = Counter()
        self._held = 0
        self._touches, self._asked_s = np.zeros(count, dtype=bool), np.full(count, -math.inf)
        self.stops = LateStops(limits, self._names, sigma_rad, np.where(turns, 2.0 * math.pi, math.inf))
        self.loads = LoadLimit(limits, self._names)
        self.restart()

    def restart(self) -> None:
        """Begin anew at the next state, which may be anywhere."""
        self._clock["time"] = -math.inf
        self.stops.restart()
        self._forget()

    def _forget(self) -> None:
        self.text = self.stop = self.errors_rad_s = None
        self._known[:], self._told[:] = 0, False

    def update(
        self, commanded_rad_s: FloatArray | None, state: ArmState, late_s: float, touches: Callable[[int], bool]
    ) -> None:
        """Take the newest state, and the velocities (n,) commanded in the tick before; None: the arm is to stand still.

        late_s: the state's lateness. touches: says whether what a joint (from 0) moves may touch something. Meanwhile
        the joint does not stop an arm that does not measure its loads, and a load that rises explains its fault.
        """
        loads = _NO_LOADS if state.joint_loads_nm is None else state.joint_loads_nm
        time_s = state.time_s if state.simulated_s is None else state.simulated_s
        command = self._still if commanded_rad_s is None else commanded_rad_s
        limits, given = self._limits, (command, state.joint_positions_rad, loads)
        ends = *limits.ends_rad, limits.acceleration_rad_s2
        self.stops.update(command, state, late_s)
        if track(self._tracks, self._clock, *given, *ends, time_s, late_s):
            self._judge(state.joint_loads_nm is None, touches, time_s)
        elif self.text is not None:
            self._forget()

    def tool_error_m_s(self, pose: GripperPose) -> float:
        """Return the error of the tool's predicted velocity, in m/s; a turn counts 0.2 m from the tool's point."""
        if self.errors_rad_s is None:
            return 0.0
        error = pose.tool_jacobian @ self.errors_rad_s
        return math.hypot(*error[:3]) + LEVER_M * math.hypot(*error[3:])

    def summary(self) -> dict[str, Any]:
        """Return how often joints were noticed, by name, and how often something held or pushed one."""
        return {"noticed": dict(sorted(self._noticed.items())), "held": self._held}

    def _judge(self, blind: bool, touches: Callable[[int], bool], time_s: float) -> None:
        """Judge joints that are at fault. blind: whether loads are unknown."""
        tracks = self._tracks
        faults, presses = tracks["fault"], tracks["held"] > 0.0
        doubted = (faults > 0) & (presses | blind)
        for joint in np.flatnonzero(doubted):
            if not 0.0 <= time_s - self._asked_s[joint] < _ASKED_AGAIN_S:
                self._touches[joint], self._asked_s[joint] = touches(int(joint)), time_s
        near = doubted & self._touches
        tracks["lasts"][near] = 0.0
        held = presses & near
        known = np.where(faults == Fault.NONE, 0, np.where(held, 1, 2))
        for joint in np.flatnonzero(known > self._known):
            if known[joint] == 2:
                self._noticed[self._names[joint]] += 1
            else:
                self._held += 1
        self._known = np.where(known == 0, 0, np.maximum(known, self._known))
        own = np.where(held, Fault.NONE, faults)
        worst = Fault(int(own.max()))
        # Joints that come and go would change the words all the time.
        self._told = (self._told & (worst == self._worst)) | (own == worst if worst else faults > 0)
        self._worst = worst
        self.text = self._words(self._told, worst)
        self.errors_rad_s = np.where(held, 0.0, tracks["error"]) if worst else None
        stops = tracks["lasts"] > np.maximum(_LIMITS_S[own], np.where(presses, _PRESSING_S, 0.0))
        if not stops.any():
            self.stop = None
        elif self.stop is None:
            gravest = Fault(int(own[stops].max()))
            self.stop = self._words(stops & (own == gravest), gravest)

    def _words(self, which: BoolArray, fault: Fault) -> str:
        if fault == Fault.NONE:
            return f"something holds or pushes {self._listed(which)}"
        one, several, how = _SAYS[fault]
        return f"{self._listed(which)} {one if np.count_nonzero(which) == 1 else several}{how}"

    def _listed(self, which: BoolArray) -> str:
        first, *more = np.flatnonzero(which).tolist()
        return self._names[first] + (f" and {len(more)} more" if more else "")
