"""Tests of feelahead-operator on a real kernel: no trigger stays stiff when the controller or the process is lost."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from feelahead.both_sides.processes import SideProcess
from operator_side.controller.state import Button
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.machines.waiting import LIMIT_S, stays, wait_until
from tests.kernel.inside.armless_robot import ArmlessRobot
from tests.kernel.inside.plugged import Plugged, Variant

_HEALTHY_S = 0.7
"""Seconds for which commands are sent before arming: longer than the robot side demands"""
_PRESSED_S = 0.3
_HOLD_TO_RUN = Button.L1
_ARM = Button.OPTIONS


class Desk:
    """Virtual controller, operator side, and the robot side to which the operator side is connected."""

    def __init__(self, plugged: Plugged, operator: SideProcess, robot: ArmlessRobot) -> None:
        self.plugged = plugged
        self.operator = operator
        self.robot = robot
        self.notes: list[str] = []
        self.controller = "unknown"

    def note(self, part: str) -> None:
        """Wait until the operator side has printed a note that contains `part`."""

        def said() -> bool:
            self._listen()
            return any(part in note for note in self.notes)

        wait_until(f"a note: {part}", said, instead=lambda: self.notes)

    def controller_lost(self) -> bool:
        """Return whether the operator side's newest status reports a lost controller."""
        self._listen()
        return self.controller == "lost"

    def _listen(self) -> None:
        for event in self.operator.events():
            if event["event"] == "note":
                self.notes.append(event["text"])
            if event["event"] == "status":
                self.controller = event["controller"]
        self.operator.check()


@pytest.fixture(scope="module", params=Transport, ids=lambda transport: transport.value)
def desk(request: pytest.FixtureRequest) -> Iterator[Desk]:
    """Operator side, started before its controller is plugged in, for USB and for Bluetooth with one model."""
    with (
        ArmlessRobot() as robot,
        Plugged(Variant(request.param)) as plugged,
        SideProcess("operator_side", "operator", ["--device=hid", *robot.flags]) as operator,
    ):
        yield Desk(plugged, operator, robot)


# The tests in this order: each continues where the last one ended.


def hold(plugged: Plugged, *buttons: Button, r2_n: float = 0.0) -> None:
    """Hold these buttons only, and pull R2 with `r2_n` newtons."""
    plugged.ask(lambda controller: controller.set_buttons(frozenset(buttons)))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, r2_n))


def arm_and_pull(desk: Desk) -> None:
    """Arm with the buttons that a person uses, then pull R2 until an arm would move and R2 is stiff."""
    arm_and_move(desk)
    wait_until("the trigger is stiff", lambda: not desk.plugged.ask(lambda controller: controller.released))


def arm_and_move(desk: Desk) -> None:
    """Arm with the buttons that a person uses, then pull R2 until an arm would move."""
    plugged, robot = desk.plugged, desk.robot
    plugged.plug_in()
    robot.r2_stiffness = 0.9

    def moving() -> bool:
        # A gap, as a slow machine has them, disarms, or requires released triggers before motion continues.
        hold(plugged, _HOLD_TO_RUN)
        time.sleep(_HEALTHY_S)
        if robot.state != "armed":
            hold(plugged, _HOLD_TO_RUN, _ARM)
        else:
            hold(plugged, _HOLD_TO_RUN, r2_n=NORMAL_FINGER_FORCE_N)
        time.sleep(_PRESSED_S)
        return robot.moving

    wait_until("the arm would move", moving, instead=lambda: robot.state)


def test_without_a_controller_it_says_so_and_commands_nothing(desk: Desk) -> None:
    plugged, robot = desk.plugged, desk.robot
    desk.note("no DualSense")
    assert "waiting for a controller" in desk.notes[0]
    assert robot.commands == 0
    plugged.plug_in()
    wait_until("commands come", lambda: robot.commands > 10, instead=lambda: desk.notes)
    desk.note(f"controller: {plugged.variant.name}")
    assert robot.state == "disarmed"


@pytest.mark.parametrize(("dongle", "said"), [(False, "the controller is gone"), (True, "no new report for")])
def test_gone_in_mid_run_the_robot_stops_and_stays_disarmed(desk: Desk, dongle: bool, said: str) -> None:
    """The controller is unplugged; or it is switched off, and its dongle repeats its last report."""
    plugged, robot = desk.plugged, desk.robot
    arm_and_pull(desk)
    desk.notes.clear()
    plugged.offered.off = dongle
    if not dongle:
        plugged.unplug()
    wait_until("the robot stops", lambda: robot.state == "disarmed" and not robot.moving)
    wait_until("the operator side notices", desk.controller_lost, instead=lambda: desk.notes)
    desk.note(said)
    commands = robot.commands
    stays("commands are sent without a controller", lambda: robot.commands == commands)
    # The hands still pull R2 and hold L1.
    plugged.offered.off = False
    plugged.plug_in()
    wait_until("commands come again", lambda: robot.commands > commands + 10)
    desk.note("back again")
    wait_until("its triggers are free", lambda: plugged.ask(lambda controller: controller.released))
    stays("the robot moves again by itself", lambda: robot.state == "disarmed" and not robot.moving)


def test_stopped_with_stiff_triggers_its_watchdog_releases_them(desk: Desk) -> None:
    arm_and_pull(desk)
    os.kill(desk.operator.process_id, signal.SIGSTOP)
    try:
        released_and_stopped(desk)
    finally:
        os.kill(desk.operator.process_id, signal.SIGCONT)


def test_killed_with_stiff_triggers_its_watchdog_releases_them(desk: Desk) -> None:
    arm_and_pull(desk)
    os.kill(desk.operator.process_id, signal.SIGKILL)
    assert desk.operator.wait(LIMIT_S) == -signal.SIGKILL
    released_and_stopped(desk)


def released_and_stopped(desk: Desk) -> None:
    """Wait until the triggers are free and the robot side is disarmed."""
    wait_until("the triggers are released", lambda: desk.plugged.ask(lambda controller: controller.released))
    wait_until("the robot stops", lambda: desk.robot.state == "disarmed" and not desk.robot.moving)
