"""The process feelahead-operator with a controller on a real kernel that comes, goes, and must not stay stiff."""

import signal
import time
from types import TracebackType

from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.kernel.armless_robot import ArmlessRobot
from tests.kernel.operator_process import Operator
from tests.kernel.plugged import Plugged
from tests.kernel.waiting import require, stays, wait_until

_PATIENCE_S = 90.0
_HEALTHY_S = 0.7
"""More than the robot side asks for."""
_PRESSED_S = 0.3
_HOLD_TO_RUN = Button.L1
_ARM = Button.OPTIONS


class Desk:
    """An operator side and the robot side that it is connected to, from the first check to the last."""

    def __init__(self, operator: Operator) -> None:
        self.operator = operator
        self.robot = ArmlessRobot()

    def __enter__(self) -> "Desk":
        self.robot.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.operator.end(signal.SIGKILL)
        self.robot.__exit__(kind, error, trace)

    def connect(self) -> None:
        """Let the operator side begin."""
        self.operator.begin(["--device=hid", "--status=json", *self.robot.flags])
        wait_until(
            "the operator side connects",
            lambda: self.robot.has_operator or not self.operator.running,
            _PATIENCE_S,
            instead=lambda: self.operator.complaints,
        )
        require(self.operator.running, f"the operator side has ended: {self.operator.complaints}")


def hold(plugged: Plugged, *buttons: Button, r2_n: float = 0.0) -> None:
    """Hold these buttons and pull R2."""
    plugged.ask(lambda controller: controller.set_buttons(frozenset(buttons)))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, r2_n))


def arm_and_pull(plugged: Plugged, robot: ArmlessRobot) -> None:
    """Arm as a person does, then pull R2 until the arm would move and the trigger is stiff."""

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


def waits_for_a_controller(plugged: Plugged, desk: Desk) -> str:
    """Without a controller the operator side says so, commands nothing, and goes on when one appears."""
    operator, robot = desk.operator, desk.robot
    desk.connect()
    said = wait_until("it says so", lambda: operator.notes[0] if operator.notes else None, _PATIENCE_S)
    require("no DualSense" in said and "waiting for one" in said, f"it says: {said}")
    require(robot.commands == 0, f"{robot.commands} commands were sent")
    plugged.plug_in()
    wait_until("commands come", lambda: robot.commands > 10, _PATIENCE_S, instead=lambda: operator.notes)
    said = operator.note(f"controller: {plugged.variant.name}")
    require(robot.state == "disarmed", f"the robot is {robot.state}")
    return said


def unplugged_in_mid_run(plugged: Plugged, desk: Desk) -> str:
    """Unplugged while the arm moves: the operator side says so, the robot stops and stays disarmed once it is back."""
    operator, robot = desk.operator, desk.robot
    arm_and_pull(plugged, robot)
    plugged.unplug()
    wait_until("the robot stops", lambda: robot.state == "disarmed" and not robot.moving)
    wait_until("the operator side notices", lambda: operator.controller == "lost", instead=lambda: operator.notes)
    said = operator.note("the controller is gone")
    commands = robot.commands
    stays("commands are sent without a controller", lambda: robot.commands == commands)
    # The hands still pull R2 and hold L1.
    plugged.plug_in()
    wait_until("commands come again", lambda: robot.commands > commands + 10, _PATIENCE_S)
    operator.note("back again")
    wait_until("its triggers are free", lambda: plugged.ask(lambda controller: controller.released))
    stays("the robot moves again by itself", lambda: robot.state == "disarmed" and not robot.moving)
    return said.partition(";")[0]


def hangs(plugged: Plugged, desk: Desk) -> str:
    """Stopped with stiff triggers (SIGSTOP), the operator side's watchdog releases them, and the robot stops."""
    arm_and_pull(plugged, desk.robot)
    desk.operator.send(signal.SIGSTOP)
    try:
        wait_until("the triggers are released", lambda: plugged.ask(lambda controller: controller.released))
        wait_until("the robot stops", lambda: desk.robot.state == "disarmed" and not desk.robot.moving)
    finally:
        desk.operator.send(signal.SIGCONT)
    return "released"


def killed(plugged: Plugged, desk: Desk) -> str:
    """Killed with stiff triggers (kill -9), the operator side's watchdog releases them, and the robot stops."""
    arm_and_pull(plugged, desk.robot)
    code = desk.operator.end(signal.SIGKILL)
    require(code == -signal.SIGKILL, f"it ended with code {code}: {desk.operator.complaints}")
    wait_until("the triggers are released", lambda: plugged.ask(lambda controller: controller.released))
    wait_until("the robot stops", lambda: desk.robot.state == "disarmed" and not desk.robot.moving)
    return "released"


OPERATOR_CHECKS = (waits_for_a_controller, unplugged_in_mid_run, hangs, killed)
"""In this order: each goes on from where the one before left off."""
