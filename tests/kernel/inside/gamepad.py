"""Tests of our evdev driver on the kernel's input device. Force feedback written to it arrives as controller rumble."""

import os
import signal
from collections.abc import Iterator

import pytest

from common.clock import MonotonicClock
from common.errors import DeviceError, NoDeviceError
from feelahead.both_sides.processes import SideProcess
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble
from operator_side.controller.port import OpenController
from operator_side.controller.state import Button, ControllerState
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from operator_side.evdev.pad import find_pad
from tests.helpers.machines.waiting import wait_until
from tests.helpers.messages import feedback
from tests.kernel.inside.armless_robot import ArmlessRobot
from tests.kernel.inside.driver import bound
from tests.kernel.inside.operator_side import Desk, arm_and_move
from tests.kernel.inside.plugged import ADDRESS, Plugged, Variant

STILL = Rumble()
# 16 bits of force feedback are cut to 8 bits of a motor.
HALF, FULL = 128 / 255, 1.0


@pytest.fixture(scope="module")
def plugged() -> Iterator[Plugged]:
    """Virtual controller whose kernel driver offers force feedback."""
    with Plugged(Variant(Transport.USB)) as one:
        yield one


@pytest.fixture
def pad(plugged: Plugged) -> Iterator[OpenController]:
    """Our evdev driver, open on the virtual controller with nothing pressed."""
    bound(plugged)
    plugged.hands_off()
    found = find_pad(None)
    try:
        yield found
    finally:
        found.device.close()


def rumble(plugged: Plugged) -> Rumble:
    return plugged.ask(lambda controller: controller.rumble)


def reads(pad: OpenController, *, l2: float | None = None, r2: float | None = None) -> ControllerState | None:
    """Read the pad; return its state if the triggers have the travels `l2` and `r2`, otherwise None."""
    state = pad.device.read(0.0)
    assert state is not None
    return state if (l2 in (None, state.l2)) and (r2 in (None, state.r2)) else None


def test_it_is_found_among_the_nodes_and_its_hands_are_read(plugged: Plugged, pad: OpenController) -> None:
    assert (pad.address, pad.path) == (ADDRESS, None)
    assert plugged.identity.name in pad.name
    plugged.ask(lambda controller: controller.set_sticks(left=(1.0, -1.0), right=(-1.0, 0.5)))
    plugged.ask(lambda controller: controller.set_buttons(frozenset({Button.L1, Button.CIRCLE, Button.LEFT})))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, NORMAL_FINGER_FORCE_N))
    state = wait_until("R2 is pulled", lambda: reads(pad, r2=1.0))
    assert (state.left_stick, state.l2) == ((1.0, -1.0), 0.0)
    assert state.right_stick == pytest.approx((-1.0, 0.5), abs=0.01)
    assert state.pressed == {Button.L1, Button.CIRCLE, Button.LEFT, Button.R2}


def test_stiffness_at_the_trigger_shakes_its_motor_which_stops_by_itself(plugged: Plugged, pad: OpenController) -> None:
    clock = MonotonicClock()

    def feels(feel: Feel, left: float, right: float) -> None:
        pad.device.write(feel, clock.now())

        def shakes() -> bool:
            pad.device.read(clock.now())  # Repeats the effect.
            return rumble(plugged) == Rumble(left, right)

        wait_until(f"{feel} is felt as {left}, {right}", shakes, instead=lambda: rumble(plugged))

    feels(Feel(l2=feedback(0, 4), r2=FREE_TRIGGER), 0.0, 0.0)
    plugged.ask(lambda controller: controller.set_finger_force(NORMAL_FINGER_FORCE_N, NORMAL_FINGER_FORCE_N))
    wait_until("both are pulled", lambda: reads(pad, l2=1.0, r2=1.0))
    feels(Feel(), HALF, 0.0)
    wait_until("nobody says it again", lambda: rumble(plugged) == STILL)
    feels(Feel(r2=feedback(5, 8), rumble=Rumble(left=1.0)), FULL, FULL)
    feels(RELEASED, 0.0, 0.0)
    feels(Feel(rumble=Rumble(right=1.0)), 0.0, FULL)
    pad.device.close()
    wait_until("closing stops it", lambda: rumble(plugged) == STILL)


def test_unplugged_it_is_gone_and_found_when_it_is_back(plugged: Plugged, pad: OpenController) -> None:
    plugged.unplug()

    def gone() -> bool:
        try:
            pad.device.read(0.0)
        except DeviceError as error:
            return "the gamepad is gone" in str(error)
        return False

    wait_until("reading says that it is gone", gone)
    with pytest.raises(NoDeviceError, match="no gamepad with two sticks"):
        find_pad(None)
    bound(plugged)
    found = find_pad(ADDRESS)
    assert found.device.read(0.0) is not None
    found.device.close()


@pytest.mark.parametrize("ends", [signal.SIGSTOP, signal.SIGKILL], ids=["hanging", "killed"])
def test_an_operator_side_drives_by_it_and_leaves_no_motor_on(plugged: Plugged, ends: signal.Signals) -> None:
    bound(plugged)
    plugged.hands_off()
    with (
        ArmlessRobot() as robot,
        SideProcess("operator_side", "operator", ["--device=evdev", *robot.flags]) as operator,
    ):
        desk = Desk(plugged, operator, robot)
        desk.note("rumble in place of stiffness")
        arm_and_move(desk)
        wait_until("R2 shakes the weak motor", lambda: rumble(plugged).right > 0.5 and rumble(plugged).left == 0.0)
        os.kill(operator.process_id, ends)
        try:
            wait_until("the motors stop", lambda: rumble(plugged) == STILL)
            wait_until("the robot stops", lambda: robot.state == "disarmed" and not robot.moving)
        finally:
            os.kill(operator.process_id, signal.SIGCONT)
