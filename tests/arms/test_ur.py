"""docs/drivers/ur_arm.py by ur_rtde's own clients, with the robot side's own port and our stand-in for a UR.

The stand-in runs no URScript: what it does with registers, watchdog and safety is written by us.
"""

import itertools
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import ArmState
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.driver_session import ArmShape
from tests.arms.positions import PositionLog
from tests.arms.provide import provided
from tests.arms.trial import DRIVERS, Program
from tests.helpers.machines.waiting import wait_until
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS

pytestmark = [pytest.mark.arms, pytest.mark.processes]

STANDS_WITHIN_S = 1.0
"""The arm stands 0.2 s after a fault on an idle machine; one that goes on is seen for 2 s."""
VELOCITIES = np.array([0.0, 0.3, -0.3, 0.0, 0.0, 0.1])
VALID_S = 0.5
"""Longer than the robot side's own 0.1 s: the test may not get the processor"""
_HOSTS = itertools.count(1)


class Desk:
    """Robot side's end of the port, the controller and the driver."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._python = folder, str(provided("ur"))
        self.host = f"127.0.{os.getpid() % 200 + 1}.{next(_HOSTS)}"
        self.port = DriverPort(EPHEMERAL, "--arm", 1 << 20)
        shape = ArmShape(tuple("abcdef"), ("left", "right"), np.full(2, 0.04), 0.085, ArmLimits().of_joints(6))
        self.arm = RemoteArm(self.port, shape, lambda _: None, lambda _: None)
        self.log = PositionLog(folder / "positions.csv")
        self.programs: list[Program] = []
        self.peer = self.begin("peer", "-m", "tests.arms.peers.ur", self.host, str(self.log.path)).hurry()
        wait_until("the controller serves", lambda: "serves" in self.peer.heard())

    def begin(self, name: str, *words: str) -> Program:
        said = self._folder / f"{name}-{len(self.programs)}.txt"
        self.programs.append(Program([self._python, *words], said, {**os.environ, "PYTHONPATH": str(ROOT)}))
        return self.programs[-1]

    def begin_driver(self, *words: str, host: str = "", model: str = "ur5e") -> Program:
        script = str(DRIVERS / "ur_arm.py")
        address = f"address={self.port.endpoint}"
        return self.begin("driver", script, model, host or self.host, address, *words).hurry()

    def turn(self, moves: bool, closing: float = 0.0) -> ArmState | None:
        """Let 5 ms pass, command to move or to stand, and return the newest state."""
        now_s = self.port.wait(0.005)
        self.arm.command(VELOCITIES * moves, now_s + VALID_S)
        self.arm.command_gripper(closing, now_s + VALID_S)
        return self.arm.state(now_s) if self.arm.exchange(now_s) else None

    def until(self, what: str, holds: Callable[[ArmState], object], moves: bool = True, closing: float = 0) -> ArmState:
        """Command until a state holds; return it."""

        for _ in range(ROUNDS):
            assert any(one.process.poll() is None for one in self.programs[1:]), self.programs[-1].heard()
            state = self.turn(moves, closing)
            if state is not None and holds(state):
                return state
        return pytest.fail(f"not: {what}; {[one.heard()[-300:] for one in self.programs]}")

    def drive(self) -> None:
        """Command until the arm moves as it is told; clear what the watchdog of a busy machine's driver did."""

        def moves(state: ArmState) -> bool:
            if state.condition:
                self.peer.order("safety 1")
            return np.allclose(state.joint_velocities_rad_s, VELOCITIES, atol=0.01) and not state.condition

        self.until("the arm moves", moves)

    def stands_after_s(self, began_s: float, moves: bool = True) -> float:
        """Go on commanding for 2 s, and return how long after `began_s` the arm moved, by its own positions."""
        while time.monotonic() < began_s + 2.0:
            self.turn(moves)
        after_s = self.log.read().between(began_s, time.monotonic()).stands_after_s()
        print(f"stands after {after_s:.2f} s")
        return after_s


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    desk = Desk(tmp_path)
    try:
        yield desk
    finally:
        for program in desk.programs:
            program.send(signal.SIGCONT)
            program.kill()
        desk.port.close()


def ended(desk: Desk, driver: Program) -> tuple[int, str]:
    """Wait until the driver has ended; return its exit code and its last line."""
    for _ in range(ROUNDS):
        desk.turn(moves=True)
        if driver.process.poll() is not None:
            break
    return driver.process.wait(), driver.heard().splitlines()[-1]


def test_the_arm_follows_says_its_limits_and_stands_when_the_driver_is_ended(desk: Desk) -> None:
    driver = desk.begin_driver()
    desk.drive()
    before = desk.until("a state", lambda _: True)
    desk.until("0.1 rad", lambda state: state.joint_positions_rad[1] > before.joint_positions_rad[1] + 0.1)
    limits = desk.arm.session.said_limits
    assert limits is not None
    assert limits.velocity_rad_s == pytest.approx([np.pi] * 6)
    assert limits.latency_s == 0.03
    desk.until("it stands", lambda state: not state.joint_velocities_rad_s.any(), moves=False)
    desk.drive()
    driver.send(signal.SIGTERM)
    assert desk.stands_after_s(time.monotonic()) < STANDS_WITHIN_S
    assert ended(desk, driver)[0] == 0
    assert desk.arm.session.rejected.total() == 0
    desk.begin_driver()
    desk.drive()  # an end by a signal needs no clearing


@pytest.mark.parametrize("what", [signal.SIGKILL, signal.SIGSTOP])
def test_after_kill_9_the_watchdog_stops_the_arm_and_the_stop_has_to_be_cleared(
    desk: Desk, what: signal.Signals
) -> None:
    driver = desk.begin_driver()
    desk.drive()
    driver.send(what)
    assert desk.stands_after_s(time.monotonic()) < STANDS_WITHIN_S
    if what == signal.SIGKILL:
        desk.begin_driver()
    driver.send(signal.SIGCONT)
    state = desk.until("the stop is read", lambda state: state.condition)
    assert state.condition == "the arm is in a protective stop: Safetymode: 3, Robotmode: 7"
    assert desk.stands_after_s(time.monotonic()) == 0.0
    desk.peer.order("safety 1")
    desk.drive()


@pytest.mark.parametrize(("mode", "words"), [(3, "a protective stop"), (7, "an emergency stop"), (9, "a fault")])
def test_a_stop_of_the_arm_is_read_and_nothing_moves_until_it_is_cleared(desk: Desk, mode: int, words: str) -> None:
    desk.begin_driver()
    desk.drive()
    desk.peer.order(f"safety {mode}")
    began_s = time.monotonic()
    state = desk.until("the stop is read", lambda state: state.condition)
    assert state.condition == f"the arm is in {words}: Safetymode: {mode}, Robotmode: 7"
    assert desk.stands_after_s(began_s) < STANDS_WITHIN_S
    desk.peer.order("safety 1")
    desk.until("it is cleared", lambda state: not state.condition, moves=False)
    assert desk.stands_after_s(time.monotonic(), moves=False) == 0.0
    desk.drive()


@pytest.mark.parametrize(
    ("fault", "code", "says"),
    [
        ("kill", 5, "the connection is lost"),
        ("stop", 5, "the connection is lost"),
        ("silent", 5, "the connection is lost"),
        ("drop", 5, "the connection is lost"),  # where ur_rtde alone would begin its script anew, without a watchdog
        ("halt", 4, "the control program has ended"),
    ],
)
def test_a_driver_that_loses_the_arm_ends_in_one_line(desk: Desk, fault: str, code: int, says: str) -> None:
    driver = desk.begin_driver()
    desk.drive()
    began_s = time.monotonic()
    if fault in ("kill", "stop"):
        desk.peer.send(signal.SIGKILL if fault == "kill" else signal.SIGSTOP)
    else:
        desk.peer.order(fault)
    found, line = ended(desk, driver)
    assert (found, line[:3], says in line) == (code, "ur:", True), line
    if fault not in ("kill", "stop"):
        assert desk.stands_after_s(began_s) < STANDS_WITHIN_S


@pytest.mark.parametrize(
    ("order", "host", "model", "code", "says"),
    [
        ("", "127.0.0.1", "ur5e", 3, "no connection"),
        ("local", "", "ur5e", 4, "remote control"),
        ("mode 3", "", "ur5e", 4, "Robotmode: 3; valid: powered on"),
        ("", "", "ur6", 2, "valid: a model of ur3"),
    ],
)
def test_an_arm_that_cannot_be_driven_is_refused_in_one_line(
    desk: Desk, order: str, host: str, model: str, code: int, says: str
) -> None:
    desk.peer.order(order or "nothing")
    time.sleep(0.1)
    found, line = ended(desk, desk.begin_driver(host=host, model=model))
    assert (found, line[:3], says in line) == (code, "ur:", True), line


def test_a_second_driver_is_refused_and_the_first_drives_on(desk: Desk) -> None:
    desk.begin_driver()
    desk.drive()
    found, line = ended(desk, desk.begin_driver())
    assert found == 4
    assert "already in use" in line
    desk.drive()


def test_the_gripper_closes_holds_and_opens(desk: Desk) -> None:
    desk.peer.order("between 128")
    desk.begin_driver("gripper=2f85")
    desk.until("it holds", lambda state: state.gripper_holding, moves=False, closing=1.0)
    state = desk.until("it still holds", lambda state: state.gripper_holding, moves=False)
    assert state.gripper_opening_m == pytest.approx(0.085 * 127 / 255)
    desk.until("it is open", lambda state: state.gripper_opening_m == 0.085, moves=False, closing=-1.0)
