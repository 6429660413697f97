"""Tests of the kernel's own driver on the virtual controller, which games use."""

import contextlib
from collections.abc import Iterator

from operator_side.controller.state import Button
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.machines.waiting import wait_until
from tests.kernel.inside.kernel_view import (
    ABS_HAT0X,
    ABS_HAT0Y,
    ABS_RX,
    ABS_RY,
    ABS_RZ,
    ABS_X,
    ABS_Y,
    ABS_Z,
    BTN_SOUTH,
    BTN_TL,
    InputDevice,
    KernelView,
    seen_device,
)
from tests.kernel.inside.plugged import Plugged


def bound(plugged: Plugged) -> KernelView:
    """Plug the controller in; return the kernel's view once the driver has made its three input devices."""
    plugged.plug_in()
    view = wait_until("the kernel shows the controller", lambda: seen_device(plugged.identity))
    wait_until("three input devices", lambda: len(view.inputs()) == 3)
    return view


@contextlib.contextmanager
def opened(plugged: Plugged) -> Iterator[InputDevice]:
    """Open the input device that has the controller's sticks, triggers and buttons."""
    with InputDevice(bound(plugged).inputs()[plugged.identity.name]) as device:
        yield device


def test_hid_playstation_takes_it(plugged: Plugged) -> None:
    view = bound(plugged)
    assert view.driver == "playstation"
    name = plugged.identity.name
    inputs = set(view.inputs())
    assert inputs == {name, f"{name} Motion Sensors", f"{name} Touchpad"}
    hidraw = view.hidraw()
    assert hidraw is not None
    assert hidraw.exists()
    counts = plugged.offered.counts
    assert counts.features >= 3
    assert counts.outputs >= 1, "the driver has not set the lights"
    assert counts.refused == 0
    assert plugged.ask(lambda controller: controller.commanded.light) is not None


def test_the_kernel_sees_the_hands(plugged: Plugged) -> None:
    plugged.ask(lambda controller: controller.set_sticks(left=(1.0, 1.0), right=(-1.0, -0.5)))
    plugged.ask(lambda controller: controller.set_buttons(frozenset({Button.CROSS, Button.UP, Button.RIGHT})))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, NORMAL_FINGER_FORCE_N))
    with opened(plugged) as device:
        expected = (255, 0, 0, 0, 192, 255)
        wait_until(
            f"the axes stand at {expected}",
            lambda: device.axes(ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ) == expected,
        )
        assert device.axes(ABS_HAT0X, ABS_HAT0Y) == (1, -1), "the pad does not point up and right"
        assert (device.is_down(BTN_SOUTH), device.is_down(BTN_TL)) == (True, False)
        plugged.hands_off()
        wait_until("the axes rest", lambda: device.axes(ABS_X, ABS_Y, ABS_Z, ABS_RZ) == (128, 128, 0, 0))
        wait_until("cross is up", lambda: not device.is_down(BTN_SOUTH))
