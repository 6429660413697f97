"""Trials of LeRobot's arm: it stops before a wall, and each fault that its driver or its bus can have."""

import json
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tests.helpers.machines.waiting import wait_until
from tests.lerobot.rig import PUBLISHED, Rig
from tests.lerobot.so101 import write_model

_GENTLE: Final = 0.25
"""Scale of the speed in trials of faults, so that the arm still moves when the fault comes"""
_FAR_M: Final = 1.0
"""Where the wall stands in trials of faults: out of reach"""
_UNDER_WAY_M: Final = 0.01
_DEAF_S: Final = 0.3
_SETTLES_S: Final = 1.5


@dataclass(frozen=True)
class Approach:
    """What an approach to the wall with 2 N came to."""

    left_m: float
    """Least distance of gripper and wall"""
    began_m: float
    """Distance at the start"""
    loop_age_s: float
    """Median of the loop age"""
    states_per_s: float
    refused: dict[str, int]
    """Number of states that the robot side refused, by reason"""
    read: list[str]
    commanded: list[list[int]]
    """Goals of all servos, in steps, each time that LeRobot wrote them to the bus"""


@dataclass(frozen=True)
class Outcome:
    """What a fault came to."""

    stood_s: float
    """Time from the fault until the servos stood"""
    way_m: float
    """How far the tool went meanwhile"""
    read: list[str]
    """What the operator read from the fault on"""
    ended: int | None
    """Exit code of LeRobot's process if the fault ended it"""
    said: str
    """Last line of this process"""
    moves_again: bool
    """Whether the arm moved again, armed by the person, once the fault was gone or the process was started anew"""


def approach(driver: str, folder: Path, seconds: float = 8.0) -> Approach:
    """Let the arm approach the wall."""
    model = folder / "model.xml"
    write_model(PUBLISHED, model)
    with Rig(model, driver, folder) as rig:
        rig.wait_for("armed")
        began_m = rig.truth.distance_m(rig.bus.history[0][1])
        rig.pause(seconds)
        if driver == "lerobot-record":  # it ends by itself, after it has written its episode
            wait_until("the end of lerobot-record", rig.driver.poll)
        rig.operator.stop()
        connected_s = time.monotonic() - rig.connected_s
        rig.robot.stop()
        left_m, read, commanded = rig.nearest_m(), rig.read, rig.bus.servos.commanded
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text("utf-8"))
    arm = dict(summary["drivers"]["arm"])
    states_per_s = arm.pop("accepted") / connected_s
    return Approach(left_m, began_m, 1e-3 * summary["loop_age_ms"]["p50"], states_per_s, arm, read, commanded)


def fault(driver: str, folder: Path, strike: Callable[[Rig], None]) -> Outcome:
    """Let a fault strike an arm under way; then mend it, or start LeRobot's process anew if it ended."""
    model = folder / "model.xml"
    write_model(PUBLISHED, model, face_m=_FAR_M)
    with Rig(model, driver, folder, speed_scale=_GENTLE) as rig:
        rig.wait_for("armed")
        rig.wait_until_moved(_UNDER_WAY_M)
        before, struck_s = len(rig.read), time.monotonic()
        strike(rig)
        rig.pause(_SETTLES_S)
        stood_s, way_m = rig.stood_after(struck_s)
        if (ended := rig.driver.poll()) is None and rig.bus.dead:
            ended = wait_until("the end of LeRobot's process", rig.driver.poll)
        rig.look()
        said = rig.said()
        if rig.bus.dead:
            return Outcome(stood_s, way_m, rig.read[before:], ended, said, False)
        if ended is None:
            rig.driver.send_signal(signal.SIGCONT)
        else:
            rig.start_driver()
        read = rig.read[before:]
        rig.wait_for("armed")
        rig.wait_until_moved(_UNDER_WAY_M)
        return Outcome(stood_s, way_m, read, ended, said, True)


def killed(rig: Rig) -> None:
    """Kill LeRobot's process."""
    rig.driver.kill()


def stopped(rig: Rig) -> None:
    """Stop LeRobot's process."""
    rig.driver.send_signal(signal.SIGSTOP)


def deaf(rig: Rig) -> None:
    """Let the servos hear and answer nothing for a short time."""
    rig.bus.be_deaf(_DEAF_S)


def dead(rig: Rig) -> None:
    """Let the servos hear and answer nothing for good."""
    rig.bus.be_deaf(float("inf"))


def unplugged(rig: Rig) -> None:
    """Pull the cable to the computer."""
    rig.bus.unplug()


FAULTS: Final[dict[str, Callable[[Rig], None]]] = {
    "kill -9": killed,
    "SIGSTOP": stopped,
    f"bus dead for {_DEAF_S:g} s": deaf,
    "bus dead for good": dead,
    "cable pulled": unplugged,
}
