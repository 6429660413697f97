"""Faults that happen while the arm moves, and what is seen of them."""

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from tests.arms.trial import STARTS, TOPIC, Program, Trial

LASTS_S: Final = 3.0
"""Time for which a fault is looked at"""
BACK_S: Final = 120.0


@dataclass(frozen=True)
class Fault:
    """What is done to a trial, and undone."""

    name: str
    do: Callable[[Trial], "Program | None"]
    """Returns a program that this fault starts, which is killed at the end"""
    undo: Callable[[Trial], None] = lambda _: None
    peers: tuple[str, ...] = ("franka", "ros2")
    moves_on: bool = False
    """Whether it need not stop the arm"""
    reads: str = ""
    """Words that the operator reads"""


@dataclass(frozen=True)
class Outcome:
    """What was seen of a fault."""

    stands_after_s: float | None
    """By the peer's own positions; None if the peer was killed"""
    way_rad: float
    """Largest way of a joint after the fault"""
    reads: str
    """What the operator reads, from the state and its reason"""
    back: bool
    """Whether a new operator can arm and move the arm after the fault"""


def suffer(trial: Trial, fault: Fault) -> Outcome:
    """Let a fault happen to an arm that moves; return what was seen."""
    trial.drive()
    began_s = time.monotonic()
    program = fault.do(trial)
    if program is not None and "sends" in (words := program.heard().split()):
        began_s = float(words[words.index("sends") + 1])  # its own start is no part of the fault
    trial.watch(LASTS_S)
    seen = trial.positions().between(began_s, time.monotonic())
    fault.undo(trial)
    if program is not None:
        program.kill()
    reads = [_read(one) for one in trial.statuses("operator", began_s)]
    changed = [one for one in reads if one != "armed"]
    trial.watch(1.5)  # a new driver is heard after a second
    killed = len(seen.times_s) == 0 or seen.times_s[-1] < began_s + 0.1
    return Outcome(
        None if killed else seen.stands_after_s(), seen.moved_rad(), (changed or ["armed"])[0], comes_back(trial)
    )


def _read(status: dict[str, Any]) -> str:
    """Return what an operator reads first: that the link is lost, or else the arm's state, and why."""
    if status["link"] == "lost":
        return f"link lost {status['link_reason'] or ''}".strip()
    return f"{status['state']} {status['stopped_because'] or ''}".strip()


def comes_back(trial: Trial) -> bool:
    """Return whether a new operator arms and moves the arm."""
    try:
        trial.drive(limit_s=BACK_S)
    except AssertionError:
        return False
    return True


def _kill_driver(trial: Trial) -> None:
    assert trial.driver is not None
    trial.driver.kill()


def _kill_peer(trial: Trial) -> None:
    assert trial.peer is not None
    trial.peer.kill()


def _stop(which: str, what: signal.Signals) -> Callable[[Trial], None]:
    return lambda trial: getattr(trial, which).send(what)


def _held(which: str, seconds: float) -> Callable[[Trial], None]:
    def hold(trial: Trial) -> None:
        getattr(trial, which).send(signal.SIGSTOP)
        trial.watch(seconds)
        getattr(trial, which).send(signal.SIGCONT)

    return hold


def _order(line: str) -> Callable[[Trial], None]:
    def give(trial: Trial) -> None:
        assert trial.peer is not None
        trial.peer.order(line)

    return give


def _second(*words: str) -> Callable[[Trial], Program]:
    def begin(trial: Trial) -> Program:
        program = trial.program("-m", "tests.arms.peers.second_sender", *words)
        trial.wait_until("the second sender sends", lambda: "sends" in program.heard())
        return program

    return begin


def _second_driver(trial: Trial) -> Program:
    first = trial.driver
    trial.begin_driver()
    second, trial.driver = trial.driver, first
    assert second is not None
    return second


def _topic(trial: Trial) -> Program:
    return _second("goals", TOPIC[trial.kind.controls], *STARTS)(trial)


FAULTS: Final = (
    Fault("kill -9 of the driver", _kill_driver, Trial.begin_driver),
    Fault("SIGSTOP of the driver", _stop("driver", signal.SIGSTOP), _stop("driver", signal.SIGCONT)),
    Fault("the driver stands still for 0.3 s", _held("driver", 0.3)),
    Fault("SIGSTOP of the peer", _stop("peer", signal.SIGSTOP), _stop("peer", signal.SIGCONT)),
    Fault("the peer stands still for 0.3 s", _held("peer", 0.3)),
    Fault("kill -9 of the robot side, which starts anew", Trial.kill_robot, Trial.begin_robot),
    Fault("a reflex of the arm", _order("reflex"), peers=("franka",), reads="protective stop"),
    Fault("states are silent for 2 s", _order("silent 2"), peers=("ros2",)),
    Fault("states are 0.3 s late for 2 s", _order("late 0.3 2"), peers=("ros2",)),
    Fault("a second sender of the same joints", _second("states", *STARTS), peers=("ros2",), reads="two nodes"),
    Fault("a second sender of goals", _topic, peers=("ros2",), reads="this sender alone"),
    Fault("a second driver", _second_driver, moves_on=True),
    Fault("kill -9 of the peer, which starts anew", _kill_peer, Trial.begin_peer),
)
