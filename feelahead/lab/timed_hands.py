"""Operator side whose scripted person drives to and fro; it logs the age of the fields that the controller gets.

    python timed_hands.py --drives=rest|straight|aside|task --log=FILE.json and the operator side's flags

It runs by itself with the Python of another version, too, so it uses only what versions have in common.
"""

import functools
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import operator_side.controllers
from common.clock import MonotonicClock
from common.command.command_line import run_command
from operator_side.core import OperatorSide
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.main import command
from operator_side.people.arming_hands import ArmingHands
from operator_side.people.port import FingerInput, Pulling

_FORCE_N: Final = 2.0
_CYCLE_S: Final = 3.0
_ASIDE: Final = 0.5
"""Deflection of the stick, -1 to 1"""
_AT_ONCE_S: Final = 0.002
"""Time from the arrival of a field to a write, within which the field is the write's cause, in seconds"""


def pulled(aside: bool, since_s: float) -> FingerInput:
    """Return a pull of R2 and then one of L2; aside: with the left stick to the right and then to the left."""
    there = since_s % _CYCLE_S < _CYCLE_S / 2.0
    r2_n, l2_n = (_FORCE_N, 0.0) if there else (0.0, _FORCE_N)
    return FingerInput(r2_n=r2_n, l2_n=l2_n, left_stick=((_ASIDE if there else -_ASIDE) if aside else 0.0, 0.0))


class Resting(ArmingHands):
    """Person who only holds the controller."""

    def tick(self, now_s: float, screen: Any, delay_s: float) -> None:
        """Do nothing."""


class Delays:
    """Times from the robot side's tick, whose field has just arrived, to the end of the write that follows, in seconds.

    Both sides read the same clock.
    """

    def __init__(self) -> None:
        self.made_s = list[float]()
        self._clock, self._arrival = MonotonicClock(), (0.0, 0.0)

    def watch(self) -> None:
        """Measure all later arrivals and writes of this process."""
        feel, write = OperatorSide._feel, SimulatedDualSense.write

        def arrives(side: OperatorSide, felt: Any, arrival: Any, now_s: float) -> None:
            feel(side, felt, arrival, now_s)
            if arrival.fresh:
                self._arrival = self._clock.now(), felt.header.sent_s

        def writes(device: SimulatedDualSense, effects: Any, now_s: float) -> None:
            write(device, effects, now_s)
            (arrived_s, sent_s), written_s = self._arrival, self._clock.now()
            if written_s - arrived_s < _AT_ONCE_S:
                self.made_s.append(written_s - sent_s)

        setattr(OperatorSide, "_feel", arrives)  # noqa: B010
        setattr(SimulatedDualSense, "write", writes)  # noqa: B010


def main(arguments: Sequence[str]) -> int:
    """Run the operator side with these hands until it is interrupted."""
    own = dict(word[2:].split("=", 1) for word in arguments if word.startswith(("--drives=", "--log=")))
    others = [word for word in arguments if not word.startswith(("--drives=", "--log="))]
    drives, delays = own["drives"], Delays()

    def hands(device: SimulatedDualSense, *_: Any, **__: Any) -> ArmingHands:
        kind = Resting if drives == "rest" else ArmingHands
        return kind(device, Pulling(functools.partial(pulled, drives == "aside")))

    if drives != "task":
        setattr(operator_side.controllers, "simulated_hands", hands)  # noqa: B010
    delays.watch()
    try:
        return command(others)
    finally:
        Path(own["log"]).write_text(json.dumps(delays.made_s), encoding="utf-8")


if __name__ == "__main__":
    run_command("timed_hands", lambda _: main(sys.argv[1:]))
