"""The process feelahead-operator with a controller on a real kernel that comes, goes, and must not stay stiff."""

import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.waiting import stays, wait_until
from tests.kernel.inside.armless_robot import ArmlessRobot
from tests.kernel.inside.operator_process import Operator
from tests.kernel.inside.plugged import Plugged, Variant

_PATIENCE_S = 90.0
_HEALTHY_S = 0.7
"""More than the robot side asks for."""
_PRESSED_S = 0.3
_HOLD_TO_RUN = Button.L1
_ARM = Button.OPTIONS


@dataclass(frozen=True)
class Desk:
    """A controller, an operator side, and the robot side that it is connected to."""

    plugged: Plugged
    operator: Operator
    robot: ArmlessRobot


@pytest.fixture(scope="module", params=Transport, ids=lambda transport: transport.value)
def desk(request: pytest.FixtureRequest, operators: dict[Transport, Operator]) -> Iterator[Desk]:
    """The operator side begins before its controller is there. It is the same for the Edge."""
    operator = operators[request.param]
    with ArmlessRobot() as robot, Plugged(Variant(request.param)) as plugged:
        operator.begin(["--device=hid", "--status=json", *robot.flags])
        yield Desk(plugged, operator, robot)
        operator.end(signal.SIGKILL)


# The tests in this order: each goes on from where the one before left off.


def hold(plugged: Plugged, *buttons: Button, r2_n: float = 0.0) -> None:
    """Hold these buttons and pull R2."""
    plugged.ask(lambda controller: controller.set_buttons(frozenset(buttons)))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, r2_n))


def arm_and_pull(desk: Desk) -> None:
    """Arm as a person does, then pull R2 until the arm would move and the trigger is stiff."""
    plugged, robot = desk.plugged, desk.robot
    plugged.plug_in()

    def armed() -> bool:
        hold(plugged, _HOLD_TO_RUN)
        time.sleep(_HEALTHY_S)
        hold(plugged, _HOLD_TO_RUN, _ARM)
        time.sleep(_PRESSED_S)
        return robot.state == "armed"

    wait_until("the robot is armed", armed, _PATIENCE_S)

    def moving() -> bool:
        # A gap in the stiffness, as a slow machine has them, asks for released triggers before motion goes on.
        hold(plugged, _HOLD_TO_RUN)
        time.sleep(_PRESSED_S)
        hold(plugged, _HOLD_TO_RUN, r2_n=NORMAL_FINGER_FORCE_N)
        time.sleep(_PRESSED_S)
        return robot.moving

    robot.r2_stiffness = 0.9
    wait_until("the arm would move", moving, _PATIENCE_S, instead=lambda: robot.state)
    wait_until("the trigger is stiff", lambda: not plugged.ask(lambda controller: controller.released))


def test_without_a_controller_it_says_so_and_commands_nothing(desk: Desk) -> None:
    plugged, operator, robot = desk.plugged, desk.operator, desk.robot
    said = wait_until("it says so", lambda: operator.notes[0] if operator.notes else None, _PATIENCE_S)
    assert "no DualSense" in said
    assert "waiting for one" in said
    assert robot.commands == 0
    plugged.plug_in()
    wait_until("commands come", lambda: robot.commands > 10, _PATIENCE_S, instead=lambda: operator.notes)
    operator.note(f"controller: {plugged.variant.name}")
    assert robot.state == "disarmed"


def test_unplugged_in_mid_run_the_robot_stops_and_stays_disarmed(desk: Desk) -> None:
    plugged, operator, robot = desk.plugged, desk.operator, desk.robot
    arm_and_pull(desk)
    plugged.unplug()
    wait_until("the robot stops", lambda: robot.state == "disarmed" and not robot.moving)
    wait_until("the operator side notices", lambda: operator.controller == "lost", instead=lambda: operator.notes)
    operator.note("the controller is gone")
    commands = robot.commands
    stays("commands are sent without a controller", lambda: robot.commands == commands)
    # The hands still pull R2 and hold L1.
    plugged.plug_in()
    wait_until("commands come again", lambda: robot.commands > commands + 10, _PATIENCE_S)
    operator.note("back again")
    wait_until("its triggers are free", lambda: plugged.ask(lambda controller: controller.released))
    stays("the robot moves again by itself", lambda: robot.state == "disarmed" and not robot.moving)


def test_stopped_with_stiff_triggers_its_watchdog_releases_them(desk: Desk) -> None:
    arm_and_pull(desk)
    desk.operator.send(signal.SIGSTOP)
    try:
        released_and_stopped(desk)
    finally:
        desk.operator.send(signal.SIGCONT)


def test_killed_with_stiff_triggers_its_watchdog_releases_them(desk: Desk) -> None:
    arm_and_pull(desk)
    assert desk.operator.end(signal.SIGKILL) == -signal.SIGKILL
    released_and_stopped(desk)


def released_and_stopped(desk: Desk) -> None:
    """Wait until the triggers are free and the arm may not move."""
    wait_until("the triggers are released", lambda: desk.plugged.ask(lambda controller: controller.released))
    wait_until("the robot stops", lambda: desk.robot.state == "disarmed" and not desk.robot.moving)
