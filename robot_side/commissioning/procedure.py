"""Procedures that move an arm a little: states go in, commands come out, and whatever ends one stops the arm."""

from collections.abc import Generator, Sequence
from typing import Final, NamedTuple, Protocol, TypeVar

import numpy as np

from common.arrays import FloatArray
from common.errors import FeelaheadError
from robot_side.arm.limits import JointLimits
from robot_side.arm.load_limit import LoadLimit
from robot_side.arm.port import Arm, ArmState

PERIOD_S: Final = 0.004
"""Period of commands and looks, in seconds"""
_VALID_S: Final = 0.1
_STOPPING_S: Final = 0.1
"""Time for which the end of a procedure commands no motion, in seconds"""
SLIDE_M_PER_RAD: Final = 1.0 / 7.0
"""Way of a joint that slides, for each radian of one that turns"""
Result = TypeVar("Result")


class Seen(NamedTuple):
    """State of the arm, and the time at which it was asked for."""

    now_s: float
    state: ArmState


class Motion(NamedTuple):
    """Command until the next state."""

    velocity_rad_s: FloatArray
    """(n,)"""
    closing: float = 0.0
    """Share of the gripper's full speed: 1 closes, -1 opens"""


Procedure = Generator[Motion, Seen, Result]
"""Generator that gets each state, and yields what to command until the next"""


class Pace(Protocol):
    """Passing of time between two commands, real or virtual."""

    def wait(self) -> float:
        """Wait for one period; return the present time in s."""
        ...

    @property
    def stopped(self) -> bool:
        """Whether a person asked for the end."""
        ...


class VirtualPace:
    """Time of a simulation, which nobody waits for."""

    stopped = False

    def __init__(self) -> None:
        self._now_s = 0.0

    def wait(self) -> float:
        """Let one period pass."""
        self._now_s += PERIOD_S
        return self._now_s


class ProcedureError(FeelaheadError):
    """The arm does something else than a procedure can go on with; the text says what, for a person."""


class StoppedError(ProcedureError):
    """A person ended the procedure."""


class Watch:
    """Judge of each state: whether the arm may go on moving."""

    def __init__(self, limits: JointLimits, names: Sequence[str], oldest_s: float) -> None:
        """names (n,): the joints'. oldest_s: age of a state, in s, from which on the arm is lost."""
        self._loads, self._oldest_s = LoadLimit(limits, names), oldest_s

    def require_sound(self, seen: Seen) -> None:
        """Raise ProcedureError if the arm must not move by this state."""
        state, age_s = seen.state, seen.now_s - seen.state.time_s
        if age_s > self._oldest_s:
            raise ProcedureError(f"the arm is lost: its newest state is {age_s:.2f} s old")
        for fault in (state.condition, state.doubt, self._loads.over(state, armed=True)):
            if fault is not None:
                raise ProcedureError(fault)


def carry_out(procedure: Procedure[Result], arm: Arm, pace: Pace, watch: Watch) -> Result:
    """Run a procedure to its end and return its result; however it ends, the arm is commanded to stand.

    ProcedureError as the procedure and `watch` raise it; StoppedError if a person ends it.
    """
    stands = Motion(np.zeros(arm.joint_count))
    now_s = pace.wait()
    try:
        seen = Seen(now_s, arm.state(now_s))
        watch.require_sound(seen)
        motion = next(procedure)
        while True:
            _command(arm, motion, now_s)
            now_s = pace.wait()
            if pace.stopped:
                raise StoppedError("ended by a person: the arm is stopped")
            seen = Seen(now_s, arm.state(now_s))
            watch.require_sound(seen)
            motion = procedure.send(seen)
    except StopIteration as end:
        result: Result = end.value
        return result
    finally:
        for _ in range(round(_STOPPING_S / PERIOD_S)):
            _command(arm, stands, now_s)
            now_s = pace.wait()
            arm.state(now_s)


def _command(arm: Arm, motion: Motion, now_s: float) -> None:
    arm.command(motion.velocity_rad_s, now_s + _VALID_S)
    arm.command_gripper(motion.closing, now_s + _VALID_S)
