"""The kernel's own driver on the virtual controller, seen like games see it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from operator_side.dualsense.effects.official import Off
from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.reports.output_report import OutputReport, Rumble, build_output_report
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.felt import feedback
from tests.helpers.machines.waiting import wait_until
from tests.kernel.inside.evdev import (
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
)
from tests.kernel.inside.kernel_view import KernelView, seen_device
from tests.kernel.inside.plugged import Plugged


def bound(plugged: Plugged) -> KernelView:
    """Plug the controller in; what the kernel shows of it once its driver has finished with it."""
    plugged.plug_in()
    view = wait_until("the kernel shows the controller", lambda: seen_device(plugged.identity))
    wait_until("three input devices", lambda: len(view.inputs()) == 3)
    return view


@contextlib.contextmanager
def opened(plugged: Plugged, suffix: str = "") -> Iterator[InputDevice]:
    """One of the controller's input devices."""
    with InputDevice(bound(plugged).inputs()[plugged.identity.name + suffix]) as device:
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
    assert plugged.ask(lambda controller: controller.output.lightbar) is not None


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


def test_the_kernels_motion_sensors_say_that_it_lies_flat(plugged: Plugged) -> None:
    with opened(plugged, " Motion Sensors") as device:
        per_g = device.axis(ABS_X).resolution
        wait_until("one gravity along y", lambda: device.axes(ABS_X, ABS_Y, ABS_Z) == (0, per_g, 0))
        assert device.axes(ABS_RX, ABS_RY, ABS_RZ) == (0, 0, 0)


def test_the_kernels_rumble_spares_the_triggers(plugged: Plugged) -> None:
    effects = (feedback(position=2, strength=5), feedback(position=4, strength=8))
    write_raw(bound(plugged).hidraw(), plugged, OutputReport(l2=effects[0], r2=effects[1]))
    wait_until("the effects arrive", lambda: plugged.ask(lambda controller: controller.effects) == effects)
    with opened(plugged) as device:
        device.rumble(1.0, 0.5, 5000)
        wait_until(
            "both motors turn", lambda: plugged.ask(lambda c: c.rumble.left > 0.9 and 0.4 < c.rumble.right < 0.6)
        )
        assert plugged.ask(lambda controller: controller.effects) == effects, "the rumble changed the triggers"
    wait_until("the motors rest", lambda: plugged.ask(lambda controller: controller.rumble) == Rumble())
    assert plugged.ask(lambda controller: controller.effects) == effects, "the rumble's end changed the triggers"
    write_raw(bound(plugged).hidraw(), plugged, OutputReport(l2=Off(), r2=Off()))
    wait_until("the triggers are free", lambda: plugged.ask(lambda controller: controller.released))


def write_raw(hidraw: Path | None, plugged: Plugged, output: OutputReport) -> None:
    """Write an output report to the raw device file, as another program would."""
    assert hidraw is not None
    hidraw.write_bytes(build_output_report(output, plugged.variant.transport))
